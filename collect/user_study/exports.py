"""A study's tables: answers, scores, trials and practice, as CSV and JSON, and what each column means.

They are made anew from the participants' files and the datasets every time: nothing is kept in them alone.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from handrail.collect.user_study.design import UserStudy
from handrail.collect.user_study.folder import StudyFolder
from handrail.collect.user_study.participant import Participant
from handrail.collect.user_study.usability import SUS, sus_score
from handrail.collect.user_study.workload import TLX, TLX_PAIRS, tlx_raw, tlx_weighted
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.datasets.storage.csv_file import csv_text

_SOURCE = {"source": "people, or: demo data: no people took part"}
_WHO = {"participant": "anonymous id"}
_CONDITION = {"condition": "teleop mode; empty for a form before or after all conditions"}
COLUMNS: Mapping[str, Mapping[str, str]] = {
    "answers": _WHO
    | _CONDITION
    | {
        "form": "consent, start, tlx, tlx_pairs, sus, questions or end",
        "item": "question; of tlx_pairs, the two scales that were compared",
        "value": "as answered; of tlx_pairs, the scale that was chosen; empty: preferred not to answer",
    }
    | _SOURCE,
    "scores": _WHO
    | _CONDITION
    | {
        "score": "tlx_raw: mean of the six scales; tlx_weighted: sum of scale x weight / 15; sus",
        "value": "0 to 100; empty where an answer that it needs was not given",
    }
    | _SOURCE,
    "trials": _WHO
    | {"condition": "teleop mode", "position": "place of the condition in this participant's order, from 1"}
    | {
        "task": "task",
        "trial": "its number within task and condition, from 1; the same scene in all conditions",
        "dataset": "folder of the LeRobot dataset, in the study's folder",
        "episode_index": "of the trial in that dataset",
        "seed": "of the scene",
        "success": "as the task judges",
        "failure_reason": "empty after a success",
        "frames": "of the trial",
        "seconds": "simulated time [s]",
        "wall_time": "time it took, pauses too [s]",
        "contact_onsets": "forbidden contacts that began",
        "brakes": "updates in which the controller braked the robot",
        "late": "periods that the loop overran",
        "undos": "how often the participant went back",
        "interrupted": "how often this trial was begun before and not finished",
    }
    | _SOURCE,
    "practice": _WHO
    | {
        "condition": "teleop mode",
        "task": "task",
        "number": "of the trial of practice, from 1; nothing of it is recorded",
        "seed": "of the scene",
        "success": "as the task judges",
        "seconds": "simulated time [s]",
        "at": "time of the day (UTC)",
    }
    | _SOURCE,
}
_MEASURED = ("wall_time", "contact_onsets", "brakes", "late", "undos")  # that a dataset says as it is


def export(folder: StudyFolder, study: UserStudy) -> list[Path]:
    """Write all tables anew and return their files."""
    people = [who for who in folder.participants() if not who.erasing]
    tables = {
        "answers": [row for who in people for row in _answers(who)],
        "scores": [row for who in people for row in _scores(study, who)],
        "trials": list(_trials(folder, study, people)),
        "practice": [row for who in people for row in _practice(who)],
    }
    files = {"README.txt": _readme(study)}
    for name, rows in tables.items():
        rows = [row | {"source": study.source} for row in rows]
        content = {"demo": study.demo, "source": study.source, "rows": rows}
        files[f"{name}.json"] = json.dumps(content, indent=1) + "\n"
        files[f"{name}.csv"] = csv_text(rows) if rows else ",".join(COLUMNS[name]) + "\n"
    with explained(f"cannot write {str(folder.exports)!r}"):
        for name, text in files.items():
            write_whole(folder.exports / name, text.encode())
    return [folder.exports / name for name in files]


def scores(who: Participant, condition: str) -> dict[str, float | None]:
    """Return a participant's scores of a condition, of the forms that are done."""
    done = {form: who.answers(f"{condition}/{form}") for form in (TLX, TLX_PAIRS, SUS)}
    done = {form: items for form, items in done.items() if f"{condition}/{form}" in who.finished()}
    found: dict[str, float | None] = {}
    if TLX in done:
        found["tlx_raw"] = tlx_raw(done[TLX])
    if TLX in done and TLX_PAIRS in done:
        found["tlx_weighted"] = tlx_weighted(done[TLX], done[TLX_PAIRS])
    if SUS in done:
        found["sus"] = sus_score(done[SUS])
    return found


def _answers(who: Participant) -> Iterator[dict[str, Any]]:
    for key, form in who.forms.items():
        condition, _, name = key.rpartition("/")
        for item, value in form.get("items", {}).items():
            place = {"participant": who.name, "condition": condition, "form": name, "item": item}
            yield place | {"value": value}


def _scores(study: UserStudy, who: Participant) -> Iterator[dict[str, Any]]:
    for mode in study.modes:
        for name, value in scores(who, mode).items():
            yield {"participant": who.name, "condition": mode, "score": name, "value": value}


def _trials(folder: StudyFolder, study: UserStudy, people: Sequence[Participant]) -> Iterator[dict[str, Any]]:
    known = {who.name: who for who in people}
    for mode in study.modes:
        for task in study.tasks:
            dataset = str(folder.dataset(mode, task).relative_to(folder.root))
            for row in folder.episodes(mode, task):
                if row["participant"] in known:
                    who = known[row["participant"]]
                    yield _trial(who, mode, task, row, {"dataset": dataset}, 1 / study.fps)


def _trial(
    who: Participant, mode: str, task: str, row: Mapping[str, Any], place: Mapping[str, Any], period: float
) -> dict[str, Any]:
    cut = [
        each
        for each in who.interrupted
        if (each["condition"], each["task"], each["trial"]) == (mode, task, row["trial"])
    ]
    return {
        "participant": who.name,
        "condition": mode,
        "position": who.modes.index(mode) + 1,
        "task": task,
        "trial": row["trial"],
        **place,
        "episode_index": row["episode_index"],
        "seed": row["seed"],
        "success": row["success"],
        "failure_reason": row["failure_reason"],
        "frames": row["length"],
        "seconds": round(row["length"] * period, 3),
        **{name: row[name] for name in _MEASURED},
        "interrupted": len(cut),
    }


def _practice(who: Participant) -> Iterator[dict[str, Any]]:
    counts: dict[tuple[str, str], int] = {}
    for each in who.practice:
        place = each["condition"], each["task"]
        counts[place] = counts.get(place, 0) + 1
        said = {name: each[name] for name in ("seed", "success", "seconds", "at")}
        yield {
            "participant": who.name,
            "condition": place[0],
            "task": place[1],
            "number": counts[place],
        } | said


def _readme(study: UserStudy) -> str:
    lines = [study.title, f"Source of all that follows: {study.source}.", ""]
    lines += ["Each table is there as .csv and, the same rows, as .json. Empty cells are unknown values."]
    for name, columns in COLUMNS.items():
        lines += ["", name]
        lines += [f"  {column:<16}{meaning}" for column, meaning in columns.items()]
    return "\n".join(lines) + "\n"

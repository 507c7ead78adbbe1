"""A study's tables: answers, scores, trials and practice, as CSV and JSON, and what each column means.

They are made anew from the participants' files and the datasets every time: nothing is kept in them alone.
"""

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from handrail.collect.user_study.folder import StudyFolder
from handrail.collect.user_study.participant import Participant
from handrail.collect.user_study.questionnaires import SUS, TLX, TLX_PAIRS, sus_score, tlx_raw, tlx_weighted
from handrail.controllers.strict_toml import read_toml
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.datasets.storage.csv_file import csv_text

COLUMNS: Mapping[str, Mapping[str, str]] = read_toml(Path(__file__).with_name("columns.toml"), "columns")
"""The columns of each table, and what they mean."""
_SCORES: Mapping[str, tuple[Callable[..., float | None], tuple[str, ...]]] = {  # and the forms they need
    "tlx_raw": (tlx_raw, (TLX,)),
    "tlx_weighted": (tlx_weighted, (TLX, TLX_PAIRS)),
    "sus": (sus_score, (SUS,)),
}


def export(folder: StudyFolder) -> list[Path]:
    """Write all tables anew and return their files."""
    study = folder.study
    people = [who for who in folder.participants().values() if not who.session.erasing]
    tables = {
        "answers": [row for who in people for row in _answers(who)],
        "scores": [row for who in people for mode in study.modes for row in _scores(who, mode)],
        "trials": list(_trials(folder, people)),
        "practice": [row for who in people for row in _practice(who)],
    }
    files = {"README.txt": _readme(study.title, study.source)}
    for name, rows in tables.items():
        rows = [
            {column: (row | {"source": study.source})[column] for column in COLUMNS[name]} for row in rows
        ]
        content = {"demo": study.demo, "source": study.source, "rows": rows}
        files[f"{name}.json"] = json.dumps(content, indent=1) + "\n"
        files[f"{name}.csv"] = csv_text(rows) if rows else ",".join(COLUMNS[name]) + "\n"
    with explained(f"cannot write {str(folder.exports)!r}"):
        for name, text in files.items():
            write_whole(folder.exports / name, text.encode())
    return [folder.exports / name for name in files]


def _answers(who: Participant) -> Iterator[dict[str, Any]]:
    for key, form in who.forms.items():
        condition, _, name = key.rpartition("/")
        for item, value in form.items.items():
            place = {"participant": who.name, "condition": condition, "form": name}
            yield place | {"item": item, "value": value}


def _scores(who: Participant, mode: str) -> Iterator[dict[str, Any]]:
    """Yield the scores of a condition whose forms are done."""
    for name, (score, forms) in _SCORES.items():
        keys = [f"{mode}/{form}" for form in forms]
        if who.finished.issuperset(keys):
            value = score(*map(who.answers, keys))
            yield {"participant": who.name, "condition": mode, "score": name, "value": value}


def _trials(folder: StudyFolder, people: Sequence[Participant]) -> Iterator[dict[str, Any]]:
    known = {who.name: who for who in people}
    for mode, task, root in folder.conditions:
        for row in folder.episodes(mode, task):
            if who := known.get(row["participant"]):
                cuts = [(each.condition, each.task, each.trial) for each in who.session.interrupted]
                begun = sum(each.what == f"{mode}/{task}/{row['trial']} begun" for each in who.session.events)
                yield row | {
                    "condition": mode,
                    "position": who.session.modes.index(mode) + 1,
                    "task": task,
                    "dataset": str(root.relative_to(folder.root)),
                    "frames": row["length"],
                    "seconds": round(row["length"] * (1 / folder.study.fps), 3),
                    "interrupted": max(begun - 1, cuts.count((mode, task, row["trial"]))),
                }


def _practice(who: Participant) -> Iterator[dict[str, Any]]:
    counts = Counter[tuple[str, str]]()
    for each in who.session.practice:
        counts[each.condition, each.task] += 1
        number = counts[each.condition, each.task]
        yield {"participant": who.name, "number": number, **vars(each)}


def _readme(title: str, source: str) -> str:
    lines = [title, f"Source of all that follows: {source}.", ""]
    lines += ["Each table is there as .csv and, the same rows, as .json. Empty cells are unknown values."]
    for name, columns in COLUMNS.items():
        lines += ["", name]
        lines += [f"  {column:<16}{meaning}" for column, meaning in columns.items()]
    return "\n".join(lines) + "\n"

"""Hours of Handrail's own commands with faults."""

import json
import os
import re
import statistics
import subprocess
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from handrail.datasets.presentation.terminal import Terminal
from handrail.scripts.bench.soak.child import hear_signals
from handrail.scripts.bench.soak.config import SoakConfig
from handrail.scripts.bench.soak.notes import commit, next_number, note, read
from handrail.scripts.bench.soak.rounds import run_round
from handrail.scripts.bench.soak.workshop import Workshop

ROUNDS = "rounds.jsonl"


Row = dict[str, Any]
_HEADINGS = (
    *("fault", "how often", "during", "the command then", "saved before", "lost", "complaints"),
    *("mended by `handrail-repair`", "finished by the same command", "seconds"),
)
_PLACES = (  # on the computer where it was done
    r"(?:/[\w./-]*/)?round-[\d-]+/disk/\w+/|/[\w./-]*/(?=round-|driven-|workshop|scripts/bench/soak)"
)
_THIN = 15  # of as many looks at the memory one goes to the JSON file
_SIGNALS = {-9: "killed", -15: "ended by SIGTERM", -1: "hung up"}


def write_tables(out: Path, page: Path) -> None:
    """Write the tables of a folder into a page, and everything into the JSON beside it."""
    text = page.read_text()
    for name, table in tables(out).items():
        begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
        text = re.sub(f"{begin}.*?{end}", lambda _, t=table: f"{begin}\n{t}\n{end}", text, flags=re.DOTALL)  # noqa: B023
    page.write_text(text)
    kept = {name: read(out / f"{name}.jsonl") for name in ("rounds", "driving", "memory")}
    kept["memory"] = kept["memory"][::_THIN]
    lines = [f'"{name}": [\n{",\n".join(map(json.dumps, rows))}\n]' for name, rows in kept.items()]
    text = re.sub(_PLACES, "", "{" + ",\n".join(lines) + "}\n")
    page.with_suffix(".json").write_text(text)


def tables(out: Path) -> dict[str, str]:
    """Return the tables, by the names of their marks."""
    rounds = [row for row in read(out / "rounds.jsonl") if row.get("struck")]
    drives = [row for row in read(out / "driving.jsonl") if row.get("struck")]
    return {
        "rounds": _by_fault(rounds),
        "drives": _by_fault(drives, together=True),
        "memory": _memory(read(out / "memory.jsonl")),
        "sum": _sum(rounds, drives, read(out / "rounds.jsonl")),
    }


def _by_fault(rows: Sequence[Row], together: bool = False) -> str:
    """Return a line a fault.

    Args:
        rows: of what happened.
        together: whether all are of one recording, which had saved the more the later it was.
    """
    lines = [_line(_HEADINGS), _line(["---"] * len(_HEADINGS))]
    for fault in sorted({row["fault"] for row in rows}):
        some = [row for row in rows if row["fault"] == fault]
        lines.append(_line([fault, *_cells(some, max if together else sum)]))
    return "\n".join(lines)


def _cells(rows: Sequence[Row], all_of: Callable[[Iterable[int]], int]) -> list[str]:
    works = Counter(_kind(row["work"]) for row in rows)
    ends = Counter(_end(row) for row in rows)
    goes = [row["goes"] for row in rows if "goes" in row]
    return [
        str(len(rows)),
        _counted(works),
        _counted(ends),
        str(all_of(row["saved_before"] for row in rows)),
        str(sum(row["lost"] for row in rows)),
        str(sum(bool(row["complaints"]) for row in rows)),
        str(sum(bool(row.get("mended")) for row in rows)),
        f"{sum(row['last_code'] in (0, 2) for row in rows if row.get('goes'))} of {sum(map(bool, goes))}",
        f"{statistics.median(row['seconds'] for row in rows):.0f}",
    ]


def _kind(work: str) -> str:
    return work.split(",")[0]


def _end(row: Row) -> str:
    if "code" not in row:
        return "drove on" if not row["complaints"] else "did not drive on"
    code = row["code"]
    if code == 0:
        return "went on by itself"
    return "had to be killed" if code is None else _SIGNALS.get(code, f"ended with {code}")


def _memory(rows: Sequence[Row]) -> str:
    """Return memory and files at the beginning, the middle and the end of the longest drive."""
    drives = Counter(row["drive"] for row in rows)
    some = [row for row in rows if drives and row["drive"] == drives.most_common(1)[0][0]]
    heads = ("hours", "saved", *(f"{who}: {what}" for who in ("recording", "server") for what in _WHAT))
    lines = [_line(heads), _line(["---"] * len(heads))]
    places = sorted({round(share * (len(some) - 1)) for share in (0.02, 0.25, 0.5, 0.75, 1.0)})
    for row in (some[place] for place in places if some):
        cells = [f"{row['seconds'] / 3600:.2f}", str(row["saved"])]
        for who in ("recording", "server"):
            had = row.get(who, {})
            cells += [
                f"{had.get('rss', 0) / 1024:.0f} MB",
                str(had.get("files", "")),
                str(had.get("threads")),
            ]
        lines.append(_line(cells))
    return "\n".join(lines)


_WHAT = ("memory", "open files", "threads")


def _sum(rounds: Sequence[Row], drives: Sequence[Row], every: Sequence[Row]) -> str:
    both = [*rounds, *drives]
    hours = sum(row["seconds"] for row in rounds) / 3600
    bad = [row for row in both if row["complaints"]]
    late = sum(not row.get("struck") and "broken" not in row for row in every)
    return (
        f"{len(both)} faults ({len(rounds)} in {hours:.1f} hours of rounds, {len(drives)} in the drives);"
        f" {late} more came when the command was done already. Saved before a fault:"
        f" {sum(row['saved_before'] for row in rounds)} pieces in the rounds, and up to"
        f" {max((row['saved_before'] for row in drives), default=0)} episodes in a drive;"
        f" lost: {sum(row['lost'] for row in both)}."
        f" Rounds with something to complain of: {len(bad)}."
    )


def _counted(what: Counter[str]) -> str:
    return ", ".join(f"{name} ({count})" for name, count in what.most_common())


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def main(config: SoakConfig) -> int:
    """Run rounds until time is over."""
    hear_signals()
    out = config.folder
    os.nice(19)
    if config.drive:
        driving = [sys.executable, "-m", "handrail.scripts.bench.soak.driving", str(out), str(config.hours)]
        subprocess.Popen(driving, start_new_session=True)
    workshop = Workshop(out / "workshop")
    until, first = time.monotonic() + 3600.0 * config.hours, next_number(out / ROUNDS, config.seed)
    for number in range(first, first + config.rounds):
        if time.monotonic() > until:
            break
        scratch = out / f"round-{config.seed}-{number}"
        begun = datetime.now(UTC).isoformat(timespec="seconds")
        try:
            row = run_round(number, config.seed, scratch, workshop, config.fault, config.work)
        except Exception:  # of the soak itself: noted, and the next round begins
            row = {"round": number, "seed": config.seed, "broken": traceback.format_exc(limit=4)}
        row |= {"begun": begun, "commit": commit(), "load": round(os.getloadavg()[0], 1)}
        note(out / ROUNDS, row)
        Terminal().print(json.dumps(row))
    if config.page:
        write_tables(out, Path(config.page).expanduser())
    return 0

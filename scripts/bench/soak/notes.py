"""The notes of the soak: a line of JSON a round, whole whatever happens; and their tables on a page."""

import json
import os
import re
import statistics
import subprocess
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from handrail.datasets.presentation.markdown import markdown_table, write_part
from handrail.datasets.presentation.table import Table

ROUNDS, DRIVING, MEMORY = "rounds.jsonl", "driving.jsonl", "memory.jsonl"
Row = dict[str, Any]
_HEADINGS = (
    *("fault", "how often", "during", "the command then", "saved before", "lost", "complaints"),
    *("mended by handrail-edit repair", "finished by the same command", "seconds"),
)
_PLACES = (  # on the computer where it was done
    r"(?:/[\w./-]*/)?round-[\d-]+/disk/\w+/|/[\w./-]*/(?=round-|driven-|workshop|scripts/bench/soak)"
)
_SHARES = (0.02, 0.25, 0.5, 0.75, 1.0)  # of a drive, at which memory is shown
_THIN = 15  # of as many looks at the memory one goes to the JSON file
_ENDS = {0: "went on by itself", None: "had to be killed"}
_ENDS |= {-9: "killed", -15: "ended by SIGTERM", -1: "hung up"}
_PROGRAMS, _MEASURES = ("recording", "server"), ("memory", "open files", "threads")


def note(file: Path, row: Row) -> None:
    """Add a line to a file, and wait until the disk has it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with open(file, "a") as lines:
        lines.write(json.dumps(row | {"commit": _commit(), "load": round(os.getloadavg()[0], 1)}) + "\n")
        lines.flush()
        os.fsync(lines.fileno())


def read(file: Path) -> list[Row]:
    """Return all lines of a file; none, where it is not there."""
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def next_number(file: Path, seed: int | None = None) -> int:
    """Return the number of the next round; of a seed, if it is of one."""
    rows = [row for row in read(file) if seed is None or row["seed"] == seed]
    return 1 + max((row["round"] for row in rows), default=-1)


@lru_cache(maxsize=1)
def _commit() -> str:
    words = ["git", "-C", str(Path(__file__).parent), "rev-parse", "--short", "HEAD"]
    return subprocess.run(words, capture_output=True, text=True).stdout.strip()


def write_tables(out: Path, page: Path) -> None:
    """Write the tables of a folder into a page, and everything into the JSON beside it."""
    kept = {Path(name).stem: read(out / name) for name in (ROUNDS, DRIVING, MEMORY)}
    rounds, drives = ([row for row in kept[name] if row.get("struck")] for name in ("rounds", "driving"))
    parts = {
        "sum": _sum(rounds, drives, kept["rounds"]),
        "rounds": markdown_table(_by_fault(rounds, sum)),
        "drives": markdown_table(_by_fault(drives, max)),  # of one recording, which had saved ever more
        "memory": markdown_table(_memory(kept["memory"])),
    }
    for name, text in parts.items():
        write_part(page, "Hours of faults", name, text)
    kept["memory"] = kept["memory"][::_THIN]
    lines = [f'"{name}": [\n{",\n".join(map(json.dumps, rows))}\n]' for name, rows in kept.items()]
    page.with_suffix(".json").write_text(re.sub(_PLACES, "", "{" + ",\n".join(lines) + "}\n"))


def _by_fault(rows: Sequence[Row], all_of: Callable[[Iterable[int]], int]) -> Table:
    faults = sorted({row["fault"] for row in rows})
    return Table(
        _HEADINGS, [[each, *_cells([r for r in rows if r["fault"] == each], all_of)] for each in faults]
    )


def _cells(rows: Sequence[Row], all_of: Callable[[Iterable[int]], int]) -> list[str]:
    goes = [row for row in rows if row.get("goes")]
    return [
        str(len(rows)),
        _counted(row["work"].split(",")[0] for row in rows),
        _counted(map(_end, rows)),
        str(all_of(row["saved_before"] for row in rows)),
        str(sum(row["lost"] for row in rows)),
        str(sum(bool(row["complaints"]) for row in rows)),
        str(sum(bool(row.get("mended")) for row in rows)),
        f"{sum(row['last_code'] in (0, 2) for row in goes)} of {len(goes)}",
        f"{statistics.median(row['seconds'] for row in rows):.0f}",
    ]


def _end(row: Row) -> str:
    if "code" not in row:
        return "did not drive on" if row["complaints"] else "drove on"
    return _ENDS.get(row["code"], f"ended with {row['code']}")


def _counted(names: Iterable[str]) -> str:
    return ", ".join(f"{name} ({count})" for name, count in Counter(names).most_common())


def _memory(rows: Sequence[Row]) -> Table:
    """Return memory and files at the beginning, the middle and the end of the longest drive."""
    drives = Counter(row["drive"] for row in rows)
    some = [row for row in rows if row["drive"] == drives.most_common(1)[0][0]]
    lines = []
    for place in sorted({round(share * (len(some) - 1)) for share in _SHARES}) if some else ():
        cells = [f"{some[place]['seconds'] / 3600:.2f}", str(some[place]["saved"])]
        for each in (some[place].get(name, {}) for name in _PROGRAMS):
            cells += [f"{each.get('rss', 0) / 1024:.0f} MB", str(each.get("files")), str(each.get("threads"))]
        lines.append(cells)
    return Table(("hours", "saved", *(f"{each}: {of}" for each in _PROGRAMS for of in _MEASURES)), lines)


def _sum(rounds: Sequence[Row], drives: Sequence[Row], every: Sequence[Row]) -> str:
    both = [*rounds, *drives]
    late = sum(not row.get("struck") and "broken" not in row for row in every)
    numbers = {
        "faults": len(both),
        "in rounds": len(rounds),
        "in drives": len(drives),
        "too late": late,
        "hours of rounds": f"{sum(row['seconds'] for row in rounds) / 3600:.1f}",
        "saved before, rounds": sum(row["saved_before"] for row in rounds),
        "saved before, drives": max((row["saved_before"] for row in drives), default=0),
        "lost": sum(row["lost"] for row in both),
        "with a complaint": sum(bool(row["complaints"]) for row in both),
    }
    return markdown_table(Table(tuple(numbers), [[str(value) for value in numbers.values()]]))

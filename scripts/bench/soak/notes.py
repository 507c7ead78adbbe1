"""The notes of the soak: a line of JSON a fault, whole whatever happens; and their tables on a page."""

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
    *("fault", "how often", "saved before", "lost", "complaints"),
    *("mended by handrail-edit repair", "finished by the same command", "seconds"),
)
_PLACES = (  # on the computer where it was done
    r"(?:/[\w./-]*/)?round-[\d-]+/disk/\w+/|/[\w./-]*/(?=round-|driven-|workshop|scripts/bench/soak)"
)
_SHARES = (0.02, 0.25, 0.5, 0.75, 1.0)  # of a drive, at which memory is shown
_THIN = 15  # of as many looks at the memory one goes to the JSON file
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
    late = sum(not row.get("struck") and "broken" not in row for row in kept["rounds"])
    parts = {
        "sum": _sum(rounds, drives, late),
        "rounds": _by_fault(rounds, sum),
        "drives": _by_fault(drives, max),  # of one recording, which had saved ever more
        "memory": _memory(kept["memory"]),
    }
    for name, table in parts.items():
        write_part(page, "Hours of faults", name, markdown_table(table))
    kept["memory"] = kept["memory"][::_THIN]
    lines = [f'"{name}": [\n{",\n".join(map(json.dumps, rows))}\n]' for name, rows in kept.items()]
    page.with_suffix(".json").write_text(re.sub(_PLACES, "", "{" + ",\n".join(lines) + "}\n"))


def _by_fault(all_rows: Sequence[Row], all_of: Callable[[Iterable[int]], int]) -> Table:
    lines = []
    for fault in sorted({row["fault"] for row in all_rows}):
        rows = [row for row in all_rows if row["fault"] == fault]
        again = [row for row in rows if row.get("goes")]
        numbers = (
            len(rows),
            all_of(row["saved_before"] for row in rows),
            sum(row["lost"] for row in rows),
            sum(bool(row["complaints"]) for row in rows),
            sum(bool(row.get("mended")) for row in rows),
            f"{sum(row['last_code'] in (0, 2) for row in again)} of {len(again)}",
            f"{statistics.median(row['seconds'] for row in rows):.0f}",
        )
        lines.append([fault, *map(str, numbers)])
    return Table(_HEADINGS, lines)


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


def _sum(rounds: Sequence[Row], drives: Sequence[Row], late: int) -> Table:
    both = [*rounds, *drives]
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
    return Table(tuple(numbers), [list(map(str, numbers.values()))])

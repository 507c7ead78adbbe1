"""What is written down as it goes: a line a round, whole whatever happens to who writes it."""

import json
import os
import subprocess
from functools import lru_cache
from pathlib import Path
from typing import Any


def note(file: Path, row: dict[str, Any]) -> None:
    """Add a line to a file, and wait until the disk has it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with open(file, "a") as lines:
        lines.write(json.dumps(row) + "\n")
        lines.flush()
        os.fsync(lines.fileno())


def read(file: Path) -> list[dict[str, Any]]:
    """Return all lines of a file; none, where it is not there."""
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def next_number(file: Path, seed: int | None = None) -> int:
    """Return the number of the next round; of a seed, if it is of one."""
    rows = [row for row in read(file) if seed is None or row["seed"] == seed]
    return 1 + max((row["round"] for row in rows), default=-1)


@lru_cache(maxsize=1)
def commit() -> str:
    """Return which version of Handrail is tested."""
    words = ["git", "-C", str(Path(__file__).parent), "rev-parse", "--short", "HEAD"]
    return subprocess.run(words, capture_output=True, text=True).stdout.strip()

"""What a machine's processors are busy with."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

_TICKS = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


def family(process: int) -> dict[int, str]:
    """Return a process and its descendants, with their command lines; nothing where there is no /proc."""
    parents, words = {}, {}
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            parents[int(place.name)] = int((place / "stat").read_text().rpartition(")")[2].split()[1])
            words[int(place.name)] = (place / "cmdline").read_bytes().decode(errors="replace")
    found = {process} & set(words)
    while more := {each for each, parent in parents.items() if parent in found} - found:
        found |= more
    return {each: words.get(each, "") for each in found}


def seconds(process: int) -> float:
    """Return how long a process has kept a processor busy [s]."""
    with contextlib.suppress(OSError):
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / _TICKS
    return 0.0


@contextlib.contextmanager
def busy(programs: int) -> Iterator[None]:
    """Keep processors busy with programs that do nothing else."""
    burners = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(programs)]
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()

"""Records the same episodes with different numbers of workers, each time with the command that people use."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from handrail.collect.execution.config import ExecutionConfig
from handrail.controllers.errors import HandrailError
from handrail.datasets.presentation.table import Table
from handrail.datasets.reading.digest import digest_of_dataset
from handrail.datasets.reading.reader import read_episodes
from handrail.scripts.bench.report import machine, report
from handrail.scripts.bench.scaling.config import ScalingConfig

_COMMAND = "from handrail.scripts.__main__ import main; main()"


def measure(config: ScalingConfig) -> dict[str, Any]:
    """Return what each number of workers took, and the Ray cluster.

    Efficiency is episodes a core-second against the first number of workers, where every worker counts as a
    core: of the whole command, and of the time between the first episode's beginning and the last one's end.

    Args:
        config: of the measurement.
    """
    config.check()
    load = os.getloadavg()[0]
    above = Path(config.folder).expanduser().absolute() if config.folder else None
    with tempfile.TemporaryDirectory(prefix="handrail-scaling-", dir=above) as folder:
        places = enumerate(config.places)
        runs = [_run(config, place, Path(folder) / str(number)) for number, place in places]
    for run in runs:
        for span in ("seconds", "recording_seconds"):
            whole, first = run[span] * run["workers"], runs[0][span] * runs[0]["workers"]
            run["efficiency" if span == "seconds" else "recording_efficiency"] = first / whole
    settings = {name: getattr(config, name) for name in ("task", "mode", "episodes")}
    return settings | {"machine": machine(load), "runs": runs}


def scaling_table(results: dict[str, Any]) -> Table:
    """Return what was measured, a line for each number of workers."""
    rows = [
        [
            f"{run['workers']}{' on Ray' if run['ray'] else ''}",
            f"{run['seconds']:.1f}",
            f"{run['recording_seconds']:.1f}",
            f"{results['episodes'] / run['seconds'] / run['workers']:.3f}",
            f"{run['efficiency']:.2f}",
            f"{run['recording_efficiency']:.2f}",
            run["rows"],
        ]
        for run in results["runs"]
    ]
    computer = results["machine"]
    caption = (
        f"{results['episodes']} episodes each of {results['task']} in mode {results['mode']};"
        f" {computer['cores']} cores, load {computer['load_before']:.1f} before"
    )
    headings = (
        *("workers", "whole [s]", "recording [s]", "episodes a core-second"),
        *("efficiency, whole", "efficiency, recording", "digest of the rows"),
    )
    return Table(headings, rows, "Recording with several workers", caption)


def _run(config: ScalingConfig, place: ExecutionConfig, root: Path) -> dict[str, Any]:
    workers, where = _cores(place), ("--ray", place.ray) if place.ray else ("--workers", place.workers)
    flags: Sequence[object] = (
        *(root, "--task", config.task, "--mode", config.mode, "--seed", config.seed),
        *("--dataset.num_episodes", config.episodes, *where),
        *(("--cameras", config.cameras) if config.cameras else ()),
    )
    start = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-c", _COMMAND, "record", *map(str, flags)], capture_output=True, text=True
    )
    seconds = time.monotonic() - start
    if done.returncode:
        raise HandrailError(f"{where[0]} {where[1]}: recording failed: {done.stderr.strip()[-300:]}")
    rows = read_episodes(root)
    first = min(row["started"] for row in rows)
    last = max(row["started"] + row["wall_time"] for row in rows)
    return {
        "workers": workers,
        "ray": bool(place.ray),
        "seconds": seconds,
        "recording_seconds": last - first,
        "frames": sum(row["length"] for row in rows),
        "rows": digest_of_dataset(root),
    }


def _cores(place: ExecutionConfig) -> int:
    """Return how many cores share the work."""
    if not place.ray:
        return place.processes
    from handrail.collect.execution.cluster import Cluster

    cluster = Cluster(place.ray)
    try:
        return cluster.cores
    finally:
        cluster.close()


def main(config: ScalingConfig) -> int:
    """Measure and print the table; 1 if the recordings differ."""
    results = measure(config)
    report("scaling", config, [scaling_table(results)], results)
    return int(len({run["rows"] for run in results["runs"]}) != 1)

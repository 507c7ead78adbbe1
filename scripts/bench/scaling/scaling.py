"""Records the same episodes with different numbers of workers, each time with the command that people use."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.flags import check_names, one_of
from handrail.collect.operators.modes import MODES
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import AtLeastOne, Count
from handrail.datasets.lists import Names, Numbers
from handrail.datasets.presentation.table import Table
from handrail.datasets.reading.digest import digest_of_dataset
from handrail.datasets.reading.reader import read_episodes
from handrail.scripts.bench.report import ReportConfig, machine, report

_COMMAND = "from handrail.scripts.__main__ import main; main()"


@dataclass(frozen=True)
class ScalingConfig(ReportConfig):
    """Measure how many episodes a second some workers record, against one, and that the rows are the same."""

    task: Annotated[str, one_of(TASKS)] = "reach"
    """What is recorded."""
    mode: Annotated[str, one_of(MODES)] = "ee"
    """In which teleop mode."""
    cameras: Names = ""
    """With which cameras: wrist, scene or both; none by default."""
    episodes: AtLeastOne = 60
    """Episodes of each recording."""
    workers: Numbers = (1, 2)
    """Numbers of workers, each a recording of its own; the first is what the others are compared with."""
    ray: str = ""
    """One recording more, on a Ray cluster: auto, or its address (see docs/cluster.md)."""
    folder: str = ""
    """Where the recordings lie meanwhile, the system's folder for such files by default; with --ray, one that
    all computers of the cluster see."""
    seed: Count = 0
    """Of the recordings."""

    @property
    def places(self) -> tuple[ExecutionConfig, ...]:
        """Where it is recorded, one after the other."""
        shared = (ExecutionConfig(ray=self.ray),) if self.ray else ()
        return (*(ExecutionConfig(workers=count) for count in self.workers), *shared)

    def check(self) -> None:
        """Check the settings."""
        super().check()
        check_names("task", "--task", (self.task,), TASKS)
        check_names("mode", "--mode", (self.mode,), MODES)
        if min(self.workers, default=0) < 1:
            raise HandrailError(f"--workers {self.workers}: expected whole numbers of 1 or more")
        for place in self.places:
            place.check_execution()
        if self.folder and not Path(self.folder).expanduser().is_dir():
            raise HandrailError(f"--folder {self.folder}: expected a folder, found none")


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

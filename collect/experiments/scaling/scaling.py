"""Records the same episodes with different numbers of workers, each time with the command that people use."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from handrail.collect.experiments.scaling.config import ScalingConfig
from handrail.controllers.errors import HandrailError
from handrail.datasets.presentation.table import Table
from handrail.datasets.reading.digest import digest_of_rows
from handrail.datasets.reading.reader import read_episodes

_COMMAND = "from handrail.scripts.record import main; main()"


def measure(config: ScalingConfig) -> dict[str, Any]:
    """Return what each number of workers took.

    Efficiency is episodes a core-second against the first number of workers, where every worker counts as a
    core: of the whole command, and of the time between the first episode's beginning and the last one's end.

    Args:
        config: of the measurement.

    Raises:
        HandrailError: a setting is wrong, or a recording failed.
    """
    config.check()
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory(prefix="handrail-scaling-") as folder:
        runs = [_run(config, count, Path(folder) / str(place)) for place, count in enumerate(config.counts)]
    for run in runs:
        for span in ("seconds", "recording_seconds"):
            whole, first = run[span] * run["workers"], runs[0][span] * runs[0]["workers"]
            run["efficiency" if span == "seconds" else "recording_efficiency"] = first / whole
    machine = {"cores": os.cpu_count(), "load_before": load}
    return {"task": config.task, "mode": config.mode, "episodes": config.episodes} | {
        "machine": machine,
        "runs": runs,
    }


def scaling_table(results: dict[str, Any]) -> Table:
    """Return what was measured, a line for each number of workers."""
    rows = [
        [
            str(run["workers"]),
            f"{run['seconds']:.1f}",
            f"{run['recording_seconds']:.1f}",
            f"{results['episodes'] / run['seconds'] / run['workers']:.3f}",
            f"{run['efficiency']:.2f}",
            f"{run['recording_efficiency']:.2f}",
            run["rows"],
        ]
        for run in results["runs"]
    ]
    machine = results["machine"]
    caption = (
        f"{results['episodes']} episodes each of {results['task']} in mode {results['mode']};"
        f" {machine['cores']} cores, load {machine['load_before']:.1f} before"
    )
    headings = (
        *("workers", "whole [s]", "recording [s]", "episodes a core-second"),
        *("efficiency, whole", "efficiency, recording", "digest of the rows"),
    )
    return Table(headings, rows, "Recording with several workers", caption)


def _run(config: ScalingConfig, workers: int, root: Path) -> dict[str, Any]:
    flags: Sequence[object] = (
        *(root, "--task", config.task, "--mode", config.mode, "--seed", config.seed),
        *("--dataset.num_episodes", config.episodes, "--workers", workers),
        *(("--cameras", config.cameras) if config.cameras else ()),
    )
    start = time.monotonic()
    done = subprocess.run([sys.executable, "-c", _COMMAND, *map(str, flags)], capture_output=True, text=True)
    seconds = time.monotonic() - start
    if done.returncode:
        raise HandrailError(f"{workers} workers: recording failed: {done.stderr.strip()[-300:]}")
    rows = read_episodes(root)
    first = min(row["started"] for row in rows)
    last = max(row["started"] + row["wall_time"] for row in rows)
    return {
        "workers": workers,
        "seconds": seconds,
        "recording_seconds": last - first,
        "frames": sum(row["length"] for row in rows),
        "rows": digest_of_rows(root),
    }

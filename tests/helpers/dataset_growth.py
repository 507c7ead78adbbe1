"""How the time of reading a dataset grows with its episodes: the table of docs/large_datasets.md.

    python tests/helpers/dataset_growth.py FOLDER [FOLDER …]     # datasets, from small to large

Each figure is from a process of its own, with its imports done. CPU time, since machines are shared. The last
column is the exponent of the growth from the first dataset to the last, in episodes.
"""

import math
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ["HF_HUB_OFFLINE"] = "1"

import numpy as np

from handrail.datasets.comparison.compare import compare
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.format.data_file import data_files
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import read_manifest
from handrail.datasets.quality.summary import summarize
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.reader import read_episodes, read_info, read_rows_of
from handrail.datasets.recording.writer import EpisodeWriter

READS = 200


def lerobot_dataset(root: Path):
    """Open a dataset with LeRobot."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    return LeRobotDataset("me/set", root=root)


def resume(root: Path) -> None:
    """Open a dataset to add to it, and add nothing."""
    EpisodeWriter.resume(root, read_manifest(Layout(root))).close()


def read_some(root: Path):
    """Return what reads some episodes here and there, once what it needs is open."""
    info, rows = read_info(root), read_episodes(root)
    chosen = np.random.default_rng(0).integers(0, len(rows), READS)

    def read() -> None:
        with data_files() as files:
            for number in chosen:
                read_rows_of(info, rows[number], ["action", "observation.state"], files)

    return read


def items(root: Path):
    """Return what reads some items of LeRobot's here and there."""
    dataset = lerobot_dataset(root)
    chosen = np.random.default_rng(0).integers(0, len(dataset), READS)
    return lambda: [dataset[int(index)] for index in chosen]


MEASURED = {
    "open: read_episodes": lambda root: lambda: read_episodes(root),
    "check, remembered": lambda root: [check_whole(root), lambda: check_whole(root)][1],
    "resume": lambda root: lambda: resume(root),
    f"{READS} episodes here and there": read_some,
    "inspect": lambda root: lambda: summarize(root),
    "LeRobotDataset, first time": lambda root: lambda: lerobot_dataset(root),
    "LeRobotDataset, again": lambda root: [lerobot_dataset(root), lambda: lerobot_dataset(root)][1],
    f"{READS} items of LeRobotDataset": items,
    "compare with itself": lambda root: lambda: compare(CompareConfig((str(root),) * 2, labels=("a", "b"))),
}


def measure(name: str, root: Path) -> str:
    """Return CPU time [s] and the memory at its peak [MB]."""
    if "LeRobot" in name:
        import lerobot.datasets.lerobot_dataset  # noqa: F401 - its import is not measured
    run = MEASURED[name](root)
    begun = time.process_time()
    run()
    spent = time.process_time() - begun
    return f"{spent} {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024}"


def table(roots: list[Path]) -> list[str]:
    """Return the table, a line each."""
    counts = [read_info(root).episodes for root in roots]
    lines = ["| CPU time [s], memory [MB] | " + " | ".join(map(str, counts)) + " | exponent |"]
    lines.append("|---" * (len(roots) + 2) + "|")
    for name in MEASURED:
        found = [_in_a_process(name, root) for root in roots]
        growth = (
            math.log(found[-1][0] / found[0][0]) / math.log(counts[-1] / counts[0])
            if len(counts) > 1
            else 0.0
        )
        cells = " | ".join(f"{seconds:.3g}, {memory:.0f}" for seconds, memory in found)
        lines.append(f"| {name} | {cells} | {growth:.2f} |")
    return lines


def _in_a_process(name: str, root: Path) -> list[float]:
    cache = tempfile.mkdtemp()
    try:
        words = [sys.executable, __file__, "--one", name, str(root)]
        environment = os.environ | {"HF_DATASETS_CACHE": cache}
        done = subprocess.run(words, capture_output=True, text=True, check=True, env=environment)
        return [float(word) for word in done.stdout.split()[-2:]]
    finally:
        shutil.rmtree(cache)


if __name__ == "__main__":
    if sys.argv[1] == "--one":
        print(measure(sys.argv[2], Path(sys.argv[3])))
    else:
        print(*table([Path(word) for word in sys.argv[1:]]), sep="\n")

"""How the time of using a dataset grows with its episodes: the table of docs/large_datasets.md.

    python tests/helpers/dataset_growth.py FOLDER [FOLDER …]     # datasets, from small to large
    python tests/helpers/dataset_growth.py --only WORD FOLDER …   # only what has this word in its name
    python tests/helpers/dataset_growth.py --first COUNT FOLDER NEW   # its first episodes, as a dataset

Each figure is from a process of its own. Its imports are not counted; commands are counted from their start.
CPU time, since machines are shared. The last column is the exponent of the growth from the first dataset to
the last, in episodes.
"""

import math
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import redirect_stderr
from pathlib import Path

os.environ["HF_HUB_OFFLINE"] = "1"

import numpy as np

from handrail.datasets.comparison.compare import compare
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.comparison.page import write_comparison
from handrail.datasets.editing.pack import merge_datasets
from handrail.datasets.editing.source import EditSource
from handrail.datasets.format.data_file import data_files
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import read_manifest
from handrail.datasets.quality.summary import summarize
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.reader import read_episodes, read_info, read_rows_of
from handrail.datasets.recording.rewrite import write_anew
from handrail.datasets.recording.writer import EpisodeWriter

READS = 200
SHARD = 100  # episodes
TRAIN = (
    "lerobot-train --dataset.repo_id=me/set --policy.type=act --policy.device=cpu --policy.push_to_hub=false"
    " --policy.pretrained_backbone_weights=null --policy.chunk_size=20 --policy.n_action_steps=20"
    " --policy.use_vae=false --policy.dim_model=32 --policy.n_heads=2 --policy.dim_feedforward=32"
    " --policy.n_encoder_layers=1 --batch_size=8 --steps=1 --num_workers=0 --save_checkpoint=false"
)


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


def first_episodes(root: Path, new: Path, first: int, end: int) -> Path:
    """Write some episodes of a dataset as another one."""
    source = EditSource.open(root)
    end = min(end, len(source.rows))
    write_anew(new, source.manifest, source.pieces(range(first, end)), source.types, source.encodings)
    return new


def shards(root: Path) -> tuple[list[Path], Path]:
    """Write a dataset as shards; return them, and where they are to be put together."""
    folder, count = Path(os.environ["HF_DATASETS_CACHE"]), read_info(root).episodes
    parts = [first_episodes(root, folder / f"{at}", at, at + SHARD) for at in range(0, count, SHARD)]
    return parts, folder / "all"


def merge(root: Path):
    """Return what puts shards together."""
    parts, target = shards(root)
    return lambda: merge_datasets(parts, target)


def aggregate(root: Path):
    """Return what puts shards together with LeRobot."""
    from lerobot.datasets.aggregate import aggregate_datasets

    parts, target = shards(root)
    return lambda: aggregate_datasets([f"me/{each.name}" for each in parts], "me/all", parts, target)


def of_lerobot(root: Path):
    """Return what opens, for the first time, what LeRobot put together."""
    aggregate(root)()
    return lambda: lerobot_dataset(Path(os.environ["HF_DATASETS_CACHE"]) / "all")


def train(words: list[str]) -> None:
    """Run a command that trains for one update."""
    program = Path(sys.executable).with_name(words[0])
    subprocess.run([program, *words[1:]], check=True, capture_output=True)


def ours(root: Path) -> list[str]:
    """Return the command of ours that trains for one update."""
    out = Path(os.environ["HF_DATASETS_CACHE"]) / "policy"
    return (
        f"handrail-train {root} --output {out} --steps 1 --batch_size 8 --policy_options dim_model=32".split()
    )


def theirs(root: Path) -> list[str]:
    """Return the command of LeRobot's that trains for one update."""
    out = Path(os.environ["HF_DATASETS_CACHE"]) / "policy"
    return [*TRAIN.split(), f"--dataset.root={root}", f"--output_dir={out}"]


def report(root: Path) -> None:
    """Compare a dataset with itself and write the report."""
    output = str(Path(os.environ["HF_DATASETS_CACHE"]) / "report")
    write_comparison(compare(CompareConfig((str(root),) * 2, output, labels=("a", "b"))))


MEASURED = {
    "open: read_episodes": lambda root: lambda: read_episodes(root),
    "check, remembered": lambda root: [check_whole(root), lambda: check_whole(root)][1],
    "resume": lambda root: lambda: resume(root),
    f"{READS} episodes here and there": read_some,
    "inspect": lambda root: lambda: summarize(root),
    "LeRobotDataset, first time": lambda root: lambda: lerobot_dataset(root),
    "LeRobotDataset, again": lambda root: [lerobot_dataset(root), lambda: lerobot_dataset(root)][1],
    f"{READS} items of LeRobotDataset": items,
    "compare with itself": lambda root: lambda: report(root),
    "handrail-train, to the first update": lambda root: lambda: train(ours(root)),
    "lerobot-train, to the first update": lambda root: lambda: train(theirs(root)),
    f"handrail-edit merge of shards of {SHARD}": merge,
    f"LeRobot's aggregate of shards of {SHARD}": aggregate,
    "LeRobotDataset of the aggregate": of_lerobot,
}


def measure(name: str, root: Path) -> str:
    """Return CPU time [s] and the memory at its peak [MB]."""
    if "LeRobot" in name:
        import lerobot.datasets.lerobot_dataset  # noqa: F401 - its import is not measured
    with open(os.devnull, "w") as nowhere, redirect_stderr(nowhere):
        run = MEASURED[name](root)
        begun = time.process_time()
        run()
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    spent = time.process_time() - begun + used[1].ru_utime + used[1].ru_stime
    return f"{spent} {max(each.ru_maxrss for each in used) // 1024}"


def table(roots: list[Path], word: str = "") -> Iterator[str]:
    """Yield the table, a line each."""
    counts = [read_info(root).episodes for root in roots]
    yield "| CPU time [s], memory [MB] | " + " | ".join(map(str, counts)) + " | exponent |"
    yield "|---" * (len(roots) + 2) + "|"
    for name in (name for name in MEASURED if word in name):
        found = [_in_a_process(name, root) for root in roots]
        growth = (
            math.log(found[-1][0] / found[0][0]) / math.log(counts[-1] / counts[0])
            if len(counts) > 1
            else 0.0
        )
        cells = " | ".join(f"{seconds:.3g}, {memory:.0f}" for seconds, memory in found)
        yield f"| {name} | {cells} | {growth:.2f} |"
    yield "| bytes a frame | " + " | ".join(f"{_bytes(root):.0f}" for root in roots) + " | |"
    yield "| files | " + " | ".join(str(len(_files(root))) for root in roots) + " | |"


def _files(root: Path) -> list[Path]:
    return [path for path in root.rglob("*") if path.is_file()]


def _bytes(root: Path) -> float:
    return sum(path.stat().st_size for path in _files(root)) / read_info(root).frames


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
    elif sys.argv[1] == "--first":
        first_episodes(Path(sys.argv[3]), Path(sys.argv[4]), 0, int(sys.argv[2]))
    else:
        only = sys.argv[1] == "--only"
        folders = [Path(word).absolute() for word in sys.argv[3 if only else 1 :]]
        for line in table(folders, sys.argv[2] if only else ""):
            print(line, flush=True)

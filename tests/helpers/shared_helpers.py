"""What tests of shared recordings look at: all that a dataset says, without the clocks; and processes."""

import json
import time
from itertools import chain
from operator import itemgetter
from pathlib import Path

import av
import numpy as np
import pyarrow.parquet as pq

from handrail.datasets.format.data_file import data_files
from handrail.datasets.reading.reader import read_episodes, read_info, read_rows_of

CLOCKS = ("wall_clock", "controller.solve_time")  # of frames
EPISODE_CLOCKS = ("started", "wall_time")
PLACES = ("data/", "meta/", "videos/")  # in which file


def content(root):
    """Return every row, every line of metadata and every summary of a dataset, without clocks and places."""
    info = read_info(root)
    with data_files() as opened:
        found = {f"frames {row['episode_index']}": _frames(info, row, opened) for row in read_episodes(root)}
    files = [pq.read_table(path).to_pylist() for path in sorted(root.glob("meta/episodes/*/*.parquet"))]
    lines = sorted(chain.from_iterable(files), key=itemgetter("episode_index"))
    found["lines"] = [
        {key: line[key] for key in line if not _is_clock(key) and not key.startswith(PLACES)}
        for line in lines
    ]
    for name in ("info", "stats"):
        summary = json.loads((root / f"meta/{name}.json").read_text())
        found[name] = {key: summary[key] for key in summary if not _is_clock(key)}
    found["tasks"] = pq.read_table(root / "meta/tasks.parquet").to_pylist()
    return found


def started(root):
    """Return when each episode began, which tells recordings of the same episode apart [s]."""
    return [row["started"] for row in read_episodes(root)]


def _frames(info, row, opened):
    frames = read_rows_of(info, row, None, opened)
    return {key: (np.asarray(frames[key]).tolist()) for key in frames if key not in CLOCKS}


def _is_clock(name):
    return name in (*CLOCKS, *EPISODE_CLOCKS) or name.startswith(tuple(f"stats/{clock}/" for clock in CLOCKS))


def pictures(root):
    """Return every picture of a dataset, decoded, camera by camera."""
    for path in sorted(root.glob("videos/*/*/*.mp4")):
        with av.open(str(path)) as video:
            yield from (frame.to_ndarray(format="rgb24") for frame in video.decode(video=0))


def saved(folder):
    """Return the lines of metadata of all episodes that are saved in the shards of a folder."""
    return sorted(folder.glob("shard-*/meta/episodes/*/*.parquet"))


def wait_until(condition, seconds=300.0):
    """Wait until something is so."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not come to that"
        time.sleep(0.02)


def workers_of(process):
    """Return the processes that work for one: those forked from its server."""
    return [worker for child in children(process) for worker in children(child)]


def children(process):
    """Return the processes that a process has begun."""
    path = Path(f"/proc/{process}/task/{process}/children")
    return [int(word) for word in path.read_text().split()] if path.exists() else []

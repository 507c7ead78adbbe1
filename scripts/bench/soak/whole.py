"""What is saved on a disk, episode by episode, each with a digest of all its rows and pictures."""

import hashlib
import json
from pathlib import Path
from typing import Any

import av
import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.data_file import data_files
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.lines import count_lines
from handrail.datasets.reading.reader import DatasetInfo, read_episodes, read_info, read_rows_of

CLOCKS = ("wall_clock", "controller.solve_time")  # columns that no two recordings share
PLACES = ("index", "episode_index")  # where an episode is in its dataset
_TRIES = 5  # a file may get another name while somebody reads

Saved = dict[int, str]  # episode: digest


def saved_in(root: Path, first: int = 0) -> Saved:
    """Return what is in a dataset; nothing, where there is none yet.

    Args:
        root: of the dataset.
        first: number of its first episode in the whole recording.
    """
    if not Layout(root).info.is_file():
        return {}
    info, found = read_info(root), {}
    with data_files() as files:
        for row in read_episodes(root):
            digest = hashlib.sha256()
            names = [
                name
                for name, each in info.features.items()
                if name not in (*CLOCKS, *PLACES) and each.dtype not in ("video", "image")
            ]
            frames = read_rows_of(info, row, names, files)
            for name in sorted(frames):
                values = frames[name]
                digest.update(f"{name} {values.shape} ".encode())
                digest.update(_bytes(values))
            for name, each in info.features.items():
                if each.dtype == "video":
                    digest.update(_pictures(info, row, name))
            found[first + row["episode_index"]] = digest.hexdigest()[:16]
    return found


def saved_by(root: Path) -> Saved:
    """Return what a recording has saved, in its dataset and in its shards."""
    for chance in range(_TRIES):
        try:
            shards = sorted(root.parent.glob(f".{root.name}.shards/shard-*/"))
            found = {}
            for shard in shards:
                found |= saved_in(shard, int(shard.name.removeprefix("shard-")))
            return found | saved_in(root)
        except (HandrailError, OSError):
            if chance == _TRIES - 1:
                raise
    return {}


def lines_of(root: Path) -> int:
    """Return how many episodes a recording has saved: quick, and whatever runs."""
    shards = root.parent.glob(f".{root.name}.shards/shard-*/meta/episodes/*/*.parquet")
    return sum(map(count_lines, [*shards, *root.glob("meta/episodes/*/*.parquet")]))


def rollouts_of(file: Path) -> Saved:
    """Return the rollouts of an evaluation's file, their times left out."""
    if not file.exists():
        return {}
    arms = json.loads(file.read_bytes())["arms"]
    rows = [row for entries in arms.values() for entry in entries for row in entry["rollouts"]]
    return {row["seed"]: _digest({key: row[key] for key in row if key != "timing"}) for row in rows}


def _digest(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()[:16]


def _bytes(values: np.ndarray) -> bytes:
    return repr(values.tolist()).encode() if values.dtype == object else values.tobytes()


def _pictures(info: DatasetInfo, row: dict[str, Any], key: str) -> bytes:
    """Return a digest of the pictures of one camera of an episode."""
    place = {"chunk_index": row[f"videos/{key}/chunk_index"], "file_index": row[f"videos/{key}/file_index"]}
    path = info.root / info.video_path.format(video_key=key, **place)
    begin, end = row[f"videos/{key}/from_timestamp"], row[f"videos/{key}/to_timestamp"]
    half, digest, count = 0.5 / info.fps, hashlib.sha256(), 0
    with av.open(str(path)) as film:
        for picture in film.decode(video=0):
            if begin - half <= float(picture.time or 0.0) < end - half:
                digest.update(picture.to_ndarray(format="rgb24").tobytes())
                count += 1
    if count != row["length"]:
        raise HandrailError(f"{path}: expected {row['length']} pictures, found {count}")
    return digest.digest()

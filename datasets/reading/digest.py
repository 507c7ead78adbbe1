"""Numbers that tell a recording apart by all that it holds but its clocks: the same one has the same."""

import hashlib
from collections.abc import Iterable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from handrail.datasets.format.join import Videos
from handrail.datasets.format.schema import video_keys
from handrail.datasets.reading.reader import DatasetInfo, open_dataset

CLOCKS = ("wall_clock", "controller.solve_time")  # columns that no two recordings share


def digest_of_dataset(root: Path) -> str:
    """Return a digest of every value of every row without the clocks, then one of the pictures, if any."""
    digest = hashlib.sha256()
    with open_dataset(root) as dataset:
        info, rows = dataset.info, dataset.rows
        names = [name for name, each in info.features.items() if name not in CLOCKS and each.dtype != "video"]
        for row in rows:
            add_frames(digest, dataset.frames(row["episode_index"], names))
    return digest.hexdigest()[:16] + digest_of_pictures(info, rows)


def add_frames(digest: Any, frames: Mapping[str, np.ndarray]) -> None:
    """Add every value of an episode's columns to a digest."""
    for name, values in sorted(frames.items()):
        digest.update(f"{name} {values.shape} ".encode())
        digest.update(repr(values.tolist()).encode() if values.dtype == object else values.tobytes())


def digest_of_pictures(info: DatasetInfo, rows: Iterable[Mapping[str, Any]]) -> str:
    """Return a digest of every encoded picture of episodes, which packing and merging copy; "" of no camera.

    Args:
        info: of the dataset.
        rows: the episodes' lines of metadata.
    """
    digest, cameras = hashlib.sha256(), video_keys(info.features)
    with closing(Videos(info.fps)) as opened:
        for row in rows:
            for camera in cameras:
                digest.update(f"{camera} {row['length']} ".encode())
                for data in _encoded(info, row, camera, opened):
                    digest.update(data)
    return digest.hexdigest()[:16] if cameras else ""


def video_of(info: DatasetInfo, row: Mapping[str, Any], camera: str) -> tuple[Path, int]:
    """Return the file of a camera's pictures of an episode, and which of them is the episode's first."""
    start = row[f"videos/{camera}/from_timestamp"]
    return info.root / info.video_file(row, camera), round(start * info.fps)


def _encoded(
    info: DatasetInfo, row: Mapping[str, Any], camera: str, opened: Videos
) -> Iterable[bytes | memoryview]:
    """Return an episode's packets; all of the file where another tool encoded episodes into each other."""
    path, first = video_of(info, row, camera)
    stretch = opened.stretch(path, first, row["length"], camera)
    return [memoryview(packet) for packet in stretch.packets] if stretch else [path.read_bytes()]

"""What an encoder says of recorded pictures; what its network says is kept in the user's cache folder."""

import os
import secrets
from collections.abc import Iterator, Mapping
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.datasets.format.video import decoded
from handrail.datasets.reading.digest import digest_of_pictures, video_of
from handrail.datasets.reading.reader import DatasetInfo
from handrail.datasets.recording.frames import PICTURE
from handrail.datasets.storage.atomic import write_whole
from handrail.policies.imitation.interface.compute import threads
from handrail.policies.imitation.interface.encoder import Encoder
from handrail.policies.imitation.interface.scene_memory import SceneMemory
from handrail.policies.imitation.training.memory import pictured

_AT_ONCE = 4  # moments: what a core has near it; more takes twice as long
_FOLDER = "encoded"


def has_pictures(info: DatasetInfo, encoder: Encoder) -> bool:
    """Return whether a dataset has the pictures that an encoder reads."""
    missing = [name for name in encoder.reads.cameras if PICTURE + name not in info.features]
    if missing and pictured(info):
        words = f"expected pictures of {', '.join(encoder.reads.cameras)}, found none of {missing[0]}"
        raise HandrailError(f"dataset {str(info.root)!r}: {words}; handrail-edit render draws them")
    return not missing


def tellable(environment: FloatArray, encoder: Encoder) -> FloatArray:
    """Return recorded states of the environment, (T, e), without those numbers that an encoder never says."""
    told = np.zeros_like(environment)
    for _, parts, start in encoder.reads.objects:
        told[:, start : start + len(parts)] = environment[:, start : start + len(parts)]
    return told


def encoded(info: DatasetInfo, row: Mapping[str, Any], states: FloatArray, encoder: Encoder) -> FloatArray:
    """Return the environment's state of an episode as an encoder says it, (T, e) float32.

    Args:
        info: of the dataset; it has pictures.
        row: of the episode's metadata.
        states: of the robot, (T, s).
        encoder: that reads the episode's pictures.
    """
    folder = Path(os.environ.get("XDG_CACHE_HOME", "~/.cache")).expanduser() / "handrail" / _FOLDER
    path = folder / encoder.digest / f"{digest_of_pictures(info, [row])}.npy"
    if not path.is_file():
        with threads(1):  # a few pictures are too little to share
            _write(path, _read(info, row, encoder))
    said, memory = encoder.said(np.load(path, allow_pickle=False), states), SceneMemory(encoder.reads)
    return np.stack([memory.take(said, moment) for moment in range(len(states))])


def _read(info: DatasetInfo, row: Mapping[str, Any], encoder: Encoder) -> FloatArray:
    videos, numbers = {name: _pictures(info, row, PICTURE + name) for name in encoder.reads.cameras}, []
    for start in range(0, row["length"], _AT_ONCE):
        count = min(_AT_ONCE, row["length"] - start)
        shown = {name: np.stack(list(islice(video, count))) for name, video in videos.items()}
        numbers.append(encoder.read(shown))
    return np.concatenate(numbers)


def _pictures(info: DatasetInfo, row: Mapping[str, Any], camera: str) -> Iterator[NDArray[np.uint8]]:
    path, first = video_of(info, row, camera)
    return decoded(path, row["length"], info.features[camera], first, info.fps)


def _write(path: Path, values: FloatArray) -> None:
    """Write an array; another training may write the same one now."""
    file, own = BytesIO(), path.with_name(f"{secrets.token_hex(8)}.npy")
    np.save(file, values)
    write_whole(own, file.getvalue())
    own.replace(path)

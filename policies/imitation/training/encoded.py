"""What an encoder says of recorded pictures, computed once and kept in the user's cache folder."""

import hashlib
import os
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import torch

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.reading.digest import digest_of_pictures
from handrail.datasets.reading.reader import DatasetInfo
from handrail.datasets.recording.frames import PICTURE
from handrail.datasets.storage.atomic import write_whole
from handrail.policies.imitation.interface.encoder import Encoder
from handrail.policies.imitation.interface.scene_memory import SceneMemory
from handrail.policies.imitation.training.memory import open_pictures

_AT_ONCE = 64  # moments
_FOLDER = "encoded"


def encoded(info: DatasetInfo, row: Mapping[str, Any], states: FloatArray, encoder: Encoder) -> FloatArray:
    """Return the environment's state of an episode as an encoder says it, (T, e) float32.

    Args:
        info: of the dataset.
        row: of the episode's metadata.
        states: of the robot, (T, s).
        encoder: that reads the episode's pictures.
    """
    missing = [name for name in encoder.reads.cameras if PICTURE + name not in info.features]
    if missing:
        words = f"expected pictures of {', '.join(encoder.reads.cameras)}, found none of {missing[0]}"
        raise HandrailError(f"dataset {str(info.root)!r}: {words}; handrail-edit render draws them")
    folder = Path(os.environ.get("XDG_CACHE_HOME", "~/.cache")).expanduser() / "handrail" / _FOLDER
    name = digest_of_pictures(info, [row]) + hashlib.sha256(states.tobytes()).hexdigest()[:16]
    path = folder / encoder.digest / f"{name}.npy"
    if not path.is_file():
        Terminal(stderr=True).print(f"reading the pictures of episode {row['episode_index']}", end="\r")
        _write(path, _said(info, row, states, encoder))
    return np.load(path, allow_pickle=False)


def _said(info: DatasetInfo, row: Mapping[str, Any], states: FloatArray, encoder: Encoder) -> FloatArray:
    pictures, memory = open_pictures(info, [row["episode_index"]], {}), SceneMemory(encoder.reads)
    rows: list[FloatArray] = []
    for start in range(0, len(states), _AT_ONCE):
        part = states[start : start + _AT_ONCE]
        samples: list[Any] = [pictures[start + place] for place in range(len(part))]
        seen = {
            name: torch.stack([each[PICTURE + name] for each in samples]) for name in encoder.reads.cameras
        }
        said = encoder.look(seen, part)
        rows += [memory.take(said, moment) for moment in range(len(part))]
    return np.stack(rows)


def _write(path: Path, values: FloatArray) -> None:
    file = BytesIO()
    np.save(file, values)
    write_whole(path, file.getvalue())

"""An encoder's estimates in an episode: from its pictures, or as they would be without an error."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.datasets.format.video import decoded
from handrail.datasets.reading.digest import video_of
from handrail.datasets.reading.reader import DatasetInfo
from handrail.datasets.recording.frames import PICTURE
from handrail.policies.imitation.interface.compute import threads
from handrail.policies.imitation.interface.encoder import Encoder
from handrail.policies.imitation.interface.interface import ENVIRONMENT, STATE, PolicyInterface
from handrail.policies.imitation.interface.scene_memory import SceneMemory

Columns = dict[str, np.ndarray]
_AT_ONCE = 4  # moments: what a core has near it; more takes twice as long


def check_fits(encoder: Encoder, interface: PolicyInterface) -> None:
    """Check that an encoder reads and says what was recorded."""
    reads = encoder.reads
    for name in ("state_names", "environment_names", "channels"):
        if getattr(reads.interface, name) != getattr(interface, name):
            words = f"expected one for the dataset's robot and task, got one for {reads.robot}, {reads.task}"
            raise HandrailError(f"--encoder: {words}: other {name.replace('_', ' ')}")


def tellable(environment: FloatArray, encoder: Encoder) -> FloatArray:
    """Return recorded states of the environment, (T, e), without those numbers that an encoder never says."""
    told = np.zeros_like(environment)
    for _, parts, start in encoder.reads.objects:
        told[:, start : start + len(parts)] = environment[:, start : start + len(parts)]
    return told


def encoded(
    info: DatasetInfo, rows: Sequence[Mapping[str, Any]], encoder: Encoder, episodes: Iterable[Columns]
) -> Iterator[Columns]:
    """Yield episodes with what an encoder can say of where things are: the truth, where it was recorded."""
    for row, episode in zip(rows, episodes, strict=True):
        truth = episode.get(ENVIRONMENT)
        said = _read(info, row, episode[STATE], encoder) if truth is None else tellable(truth, encoder)
        yield episode | {ENVIRONMENT: said}


def _read(info: DatasetInfo, row: Mapping[str, Any], states: FloatArray, encoder: Encoder) -> FloatArray:
    """Return the environment's state of an episode as an encoder says it, (T, e) float32.

    Args:
        info: of the dataset.
        row: of the episode's metadata.
        states: of the robot, (T, s).
        encoder: that reads the episode's pictures.
    """
    if missing := [name for name in encoder.reads.cameras if PICTURE + name not in info.features]:
        words = f"expected where things are, or pictures of {', '.join(encoder.reads.cameras)}"
        raise HandrailError(f"dataset {str(info.root)!r}: {words}; found none of {missing[0]}")
    if missing := [name for name in encoder.reads.cameras if not info.features[PICTURE + name].is_video]:
        raise HandrailError(f"dataset {str(info.root)!r}: expected a video of {missing[0]}, got pictures")
    videos, numbers = {name: _pictures(info, row, PICTURE + name) for name in encoder.reads.cameras}, []
    with threads(1):  # a few pictures are too little to share
        for start in range(0, row["length"], _AT_ONCE):
            count = min(_AT_ONCE, row["length"] - start)
            shown = {name: np.stack(list(islice(video, count))) for name, video in videos.items()}
            numbers.append(encoder.read(shown))
    said, memory = encoder.said(np.concatenate(numbers), states), SceneMemory(encoder.reads)
    return np.stack([memory.take(said, moment) for moment in range(len(states))])


def _pictures(info: DatasetInfo, row: Mapping[str, Any], camera: str) -> Iterator[NDArray[np.uint8]]:
    path, first = video_of(info, row, camera)
    return decoded(path, row["length"], info.features[camera], first, info.fps)

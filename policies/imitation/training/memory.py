"""A dataset in memory: a batch is one indexing operation on columns.

LeRobot reads a sample at a time from Arrow tables, and an action chunk row by row: a few batches a second.
The tensors are the same.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.schema import POLICY_PREFIXES, Feature
from handrail.datasets.reading.reader import DatasetInfo
from handrail.policies.imitation.interface.interface import ACTION
from handrail.policies.imitation.training.corrections import Draws

if TYPE_CHECKING:
    from lerobot.datasets.lerobot_dataset import LeRobotDataset


PICTURES = ("video", "image")
_NOWHERE = "handrail/local--only"  # no name on the hub, from where LeRobot would fetch what is missing


@dataclass(frozen=True)
class MemoryMeta:
    """The answers to what LeRobot's policies ask a dataset's metadata for."""

    features: dict[str, dict[str, Any]]
    """By key, each with `dtype`, `shape` and `names`."""
    stats: dict[str, dict[str, np.ndarray]]
    """By key, each with `mean`, `std`, `min`, `max`, quantiles."""
    fps: int
    """Frames a second [Hz]."""
    lengths: tuple[int, ...]
    """Frames of each episode."""
    robot_type: str = ""

    @property
    def camera_keys(self) -> list[str]:
        """Keys of pictures."""
        return [key for key, feature in self.features.items() if feature["dtype"] in PICTURES]


@dataclass(frozen=True)
class MemoryDataset:
    """Samples of some episodes, with a window of frames where a policy asks for one."""

    meta: MemoryMeta
    columns: Mapping[str, torch.Tensor]
    """All that are not pictures, (N, …) each, `frame_index` and `episode_index` among them."""
    tasks: Sequence[str]
    """The task sentence of each episode."""
    draws: Draws
    """Which frames samples begin with, and where their actions end."""
    windows: Mapping[str, Sequence[int]] = field(default_factory=dict)
    """By key the offsets [frames] of its window; beyond an episode's ends (for actions, those of `draws`) its
    first or last frame is repeated, and `KEY_is_pad` says so."""
    pictures: "LeRobotDataset | None" = None
    """LeRobot's reader of the same episodes, for the pictures alone."""

    def __len__(self) -> int:
        return sum(self.meta.lengths)

    @cached_property
    def _ends(self) -> torch.Tensor:
        return torch.from_numpy(np.stack(self.draws.ends))

    def batch(self, indices: Sequence[int]) -> dict[str, Any]:
        """Return samples (B,), each column stacked, (B, …) or (B, W, …)."""
        rows = torch.as_tensor(indices)
        episodes = self.columns["episode_index"][rows]
        first = rows - self.columns["frame_index"][rows]
        last = first + torch.tensor(self.meta.lengths)[episodes] - 1
        batch: dict[str, Any] = {}
        if self.pictures:
            samples: list[Any] = [self.pictures[int(index)] for index in indices]
            names = [name for key in self.meta.camera_keys for name in (key, f"{key}_is_pad")]
            there = [name for name in names if name in samples[0]]
            batch = {name: torch.stack([each[name] for each in samples]) for name in there}
        for key, values in self.columns.items():
            if key in self.windows:
                places = rows[:, None] + torch.tensor(list(self.windows[key]))
                low, high = self._ends[:, rows] if key == ACTION else (first, last)
                inside = places.clamp(low[:, None], high[:, None])
                batch[key], batch[f"{key}_is_pad"] = values[inside], places != inside
            else:
                batch[key] = values[rows]
        batch["task"] = [self.tasks[episode] for episode in episodes.tolist()]
        return batch


def check_finite(where: str, rows: Sequence[Mapping[str, Any]], columns: Mapping[str, np.ndarray]) -> None:
    """Check that what a policy reads and writes are numbers; `rows` are the episodes' lines of metadata."""
    for key, values in columns.items():
        wrong = ~np.isfinite(values).all(axis=tuple(range(1, values.ndim)))
        if key.startswith(POLICY_PREFIXES) and wrong.any():
            episode = rows[columns["episode_index"][wrong.argmax()]]["episode_index"]
            raise HandrailError(f"{where}: expected finite numbers, got others in {key} of episode {episode}")


def pictured(info: DatasetInfo) -> dict[str, Feature]:
    """Return the cameras of a dataset's observations."""
    return {
        key: feature
        for key, feature in info.features.items()
        if feature.dtype in PICTURES and key.startswith("observation")
    }


def open_pictures(
    info: DatasetInfo, episodes: Sequence[int], stamps: Mapping[str, list[float]]
) -> "LeRobotDataset":
    """Return LeRobot's reader of the pictures of some episodes.

    Args:
        info: of the dataset.
        episodes: numbers of these.
        stamps: by camera, the times of its window from the moment [s].
    """
    from huggingface_hub.errors import HFValidationError
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    chosen: dict[str, Any] = {"episodes": list(episodes), "delta_timestamps": dict(stamps) or None}
    try:
        return LeRobotDataset(_NOWHERE, root=info.root, **chosen)
    except HFValidationError as error:
        raise HandrailError(f"dataset {str(info.root)!r}: expected all files, some are missing") from error


def picture_stats(pictures: "LeRobotDataset", key: str) -> dict[str, np.ndarray]:
    """Return the statistics of a camera's pictures, brightness as ImageNet has it."""
    from lerobot.datasets.factory import IMAGENET_STATS

    if key in pictures.meta.depth_keys:
        raise HandrailError(f"--images: expected pictures in colour, found distances in {key}")
    stats = {name: np.asarray(value) for name, value in (pictures.meta.stats or {}).get(key, {}).items()}
    if not all(np.isfinite(value).all() for value in stats.values()):
        raise HandrailError(f"meta/stats.json: expected finite numbers for {key}; compute them anew")
    return stats | {name: np.asarray(value, np.float32) for name, value in IMAGENET_STATS.items()}

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

if TYPE_CHECKING:
    from lerobot.datasets.lerobot_dataset import LeRobotDataset


@dataclass(frozen=True)
class MemoryMeta:
    """What LeRobot's policies ask a dataset's metadata for.

    Attributes:
        features: by key, each with `dtype`, `shape` and `names`.
        stats: by key, each with `mean`, `std`, `min`, `max`, quantiles.
        fps: frames a second [Hz].
        lengths: frames of each episode.
        robot_type: the robot.
    """

    features: dict[str, dict[str, Any]]
    stats: dict[str, dict[str, np.ndarray]]
    fps: int
    lengths: tuple[int, ...]
    robot_type: str = ""

    @property
    def episodes(self) -> dict[str, list[int]]:
        """Where each episode begins and ends."""
        ends = np.cumsum(self.lengths).tolist()
        return {"dataset_from_index": [0, *ends[:-1]], "dataset_to_index": ends}

    @property
    def camera_keys(self) -> list[str]:
        """Keys of pictures."""
        return [key for key, feature in self.features.items() if feature["dtype"] in ("image", "video")]

    @property
    def depth_keys(self) -> list[str]:
        """Keys of pictures of distances: none."""
        return []


@dataclass(frozen=True)
class MemoryDataset:
    """Samples of some episodes, with a window of frames where a policy asks for one.

    Attributes:
        meta: what the columns are.
        columns: all that are not pictures, (N, …) each.
        tasks: the task sentence of each episode.
        windows: by key the offsets [frames] of its window; beyond an episode's ends its first or last frame
            is repeated, and `KEY_is_pad` says so.
        pictures: LeRobot's reader of the same episodes, for the pictures alone.
    """

    meta: MemoryMeta
    columns: Mapping[str, torch.Tensor]
    tasks: Sequence[str]
    windows: Mapping[str, Sequence[int]] = field(default_factory=dict)
    pictures: "LeRobotDataset | None" = None

    def __len__(self) -> int:
        return sum(self.meta.lengths)

    def batch(self, indices: Sequence[int]) -> dict[str, Any]:
        """Return samples (B,), each column stacked, (B, …) or (B, W, …)."""
        rows = torch.as_tensor(indices)
        batch: dict[str, Any] = dict(self._pictures_of(indices)) if self.pictures else {}
        for key, values in self.columns.items():
            if key in self._offsets:
                batch[key], batch[f"{key}_is_pad"] = self._window(values, rows, self._offsets[key])
            else:
                batch[key] = values[rows]
        batch["task"] = [self.tasks[episode] for episode in self._spans[0][rows].tolist()]
        return batch

    def _window(
        self, values: torch.Tensor, rows: torch.Tensor, offsets: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the windows around rows, (B, W, …), and which of them lie outside, (B, W)."""
        places = rows[:, None] + offsets
        _, starts, ends = self._spans
        first, last = starts[rows][:, None], ends[rows][:, None] - 1
        inside = places.clamp(first, last)
        return values[inside], places != inside

    @cached_property
    def _spans(self) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """For each sample its episode, where that begins and where it ends, (N,) each."""
        lengths = torch.tensor(self.meta.lengths)
        ends = torch.cumsum(lengths, 0)
        episode = torch.repeat_interleave(torch.arange(len(lengths)), lengths)
        return episode, (ends - lengths)[episode], ends[episode]

    @cached_property
    def _offsets(self) -> dict[str, torch.Tensor]:
        return {key: torch.tensor(list(offsets)) for key, offsets in self.windows.items()}

    def _pictures_of(self, indices: Sequence[int]) -> dict[str, torch.Tensor]:
        assert self.pictures is not None
        samples: list[Any] = [self.pictures[int(index)] for index in indices]
        keys = self.meta.camera_keys
        windows = [f"{key}_is_pad" for key in keys if f"{key}_is_pad" in samples[0]]
        return {key: torch.stack([sample[key] for sample in samples]) for key in (*keys, *windows)}

"""Columns as LeRobot describes them: pictures among them, and what is known of these."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.schema import Feature
from handrail.datasets.reading.reader import DatasetInfo

if TYPE_CHECKING:
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

_FLOOR = 1e-2  # [m, rad, m/s, …] least spread of a number: what hardly moved in training must not explode
_RANGES = (("min", "max"), ("q01", "q99"), ("q10", "q90"))


def pictured(info: DatasetInfo) -> dict[str, Feature]:
    """Return the cameras of a dataset's observations."""
    return {
        key: feature
        for key, feature in info.features.items()
        if feature.dtype in ("video", "image") and key.startswith("observation")
    }


def described_cameras(info: DatasetInfo) -> dict[str, dict[str, Any]]:
    """Return the cameras as LeRobot describes them."""
    found = pictured(info)
    if not found:
        raise HandrailError(f"--images: expected cameras in {str(info.root)!r}, found none")
    return {key: described(f.dtype, f.shape, f.names) for key, f in found.items()}


def picture_stats(pictures: "LeRobotDataset", key: str) -> dict[str, np.ndarray]:
    """Return what LeRobot knows of a camera's pictures, brightness as ImageNet has it."""
    from lerobot.datasets.factory import IMAGENET_STATS

    if key in pictures.meta.depth_keys:
        raise HandrailError(f"--images: expected pictures in colour, found distances in {key}")
    stats = {name: np.asarray(value) for name, value in (pictures.meta.stats or {}).get(key, {}).items()}
    if not all(np.isfinite(value).all() for value in stats.values()):
        raise HandrailError(f"meta/stats.json: expected finite numbers for {key}; compute them anew")
    return stats | {name: np.asarray(value, np.float32) for name, value in IMAGENET_STATS.items()}


def steadied(stats: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return statistics in which nothing is steadier than 0.01.

    A number that was the same throughout would otherwise be divided by (almost) nothing, and the least
    change of it when the policy drives would be huge.
    """
    stats = dict(stats, std=np.maximum(stats["std"], _FLOOR))
    for low, high in _RANGES:
        lack = np.maximum(0.0, _FLOOR - (stats[high] - stats[low]) / 2.0)
        stats |= {low: stats[low] - lack, high: stats[high] + lack}
    return stats


def described(dtype: str, shape: Sequence[int], names: Sequence[str] | None) -> dict[str, Any]:
    """Return a column as LeRobot describes it."""
    return {"dtype": dtype, "shape": tuple(shape), "names": None if names is None else list(names)}

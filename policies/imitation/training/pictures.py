"""The cameras of a dataset, read by LeRobot."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.schema import Feature
from handrail.datasets.reading.reader import DatasetInfo

if TYPE_CHECKING:
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

PICTURES = ("video", "image")
_NOWHERE = "handrail/local--only"  # no name on the hub, from where LeRobot would fetch what is missing


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
        raise HandrailError(
            f"dataset {str(info.root)!r}: expected all its files, found some missing"
        ) from error


def picture_stats(pictures: "LeRobotDataset", key: str) -> dict[str, np.ndarray]:
    """Return the statistics of a camera's pictures, brightness as ImageNet has it."""
    from lerobot.datasets.factory import IMAGENET_STATS

    if key in pictures.meta.depth_keys:
        raise HandrailError(f"--images: expected pictures in colour, found distances in {key}")
    stats = {name: np.asarray(value) for name, value in (pictures.meta.stats or {}).get(key, {}).items()}
    if not all(np.isfinite(value).all() for value in stats.values()):
        raise HandrailError(f"meta/stats.json: expected finite numbers for {key}; compute them anew")
    return stats | {name: np.asarray(value, np.float32) for name, value in IMAGENET_STATS.items()}

"""Where an episode begins to move and where it stops: what is before and after may be cut off."""

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.datasets.demonstrations.demonstration import Demonstration
from handrail.datasets.format.video import GROUP
from handrail.datasets.quality.motion import FLOOR

_SHARE = 0.01  # of an entry's range in the episode
STATE, SUCCESS = "observation.state", "next.success"


def moving_stretch(episode: Demonstration, margin: float) -> tuple[int, int]:
    """Return the first frame and the number of frames between what is idle at both ends.

    A frame is idle while |q(t) − q(end)| ≤ max(0.005, 1 % of the range) for every entry of the
    configuration q, where the end is that of its side. The first frame with success is never cut off. Where
    there are cameras, the first frame begins a group of pictures, so that videos need not be encoded anew.

    Args:
        episode: Which; its configuration in the units of its state.
        margin: Time to leave on both sides [s].
    """
    positions, count = episode.configuration, episode.count
    moved = np.flatnonzero(_away(positions, positions[0]))
    if not moved.size:
        return 0, count
    spare = round(margin * episode.fps)
    first = max(0, int(moved[0]) - spare)
    last = int(np.flatnonzero(_away(positions, positions[-1]))[-1]) + 1
    end = max(min(count, last + 1 + spare), _succeeded(episode))
    pictured = any(feature.is_video for feature in episode.info.features.values())
    first -= first % GROUP if pictured else 0
    return first, end - first


def _away(positions: FloatArray, place: FloatArray) -> BoolArray:
    """Return at which frames anything is elsewhere, (N,)."""
    still = np.maximum(FLOOR, _SHARE * np.ptp(positions, axis=0))
    return (np.abs(positions - place) > still).any(axis=1)


def _succeeded(episode: Demonstration) -> int:
    """Return how many frames there are up to the first with success; 0 without one."""
    if SUCCESS not in episode.frames:
        return 0
    done = np.flatnonzero(episode.frames[SUCCESS])
    return int(done[0]) + 1 if done.size else 0

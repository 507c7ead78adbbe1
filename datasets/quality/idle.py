"""How much of an episode nothing happened."""

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.datasets.quality.missing import DoesNotApply

WINDOW = 0.5  # [s]
FLOOR = 0.005  # net motion below which nothing moves: 5 mm where the motion is in metres
SHARE = 0.2  # of the 95th percentile


def idle_windows(positions: FloatArray, fps: float, floor: float = FLOOR) -> BoolArray:
    """Return which windows of 0.5 s are idle: ‖x(t + 0.5 s) − x(t)‖ < max(floor, 0.2 · p95).

    p95 is the 95th percentile of the same net motion in the episode.

    Args:
        positions: `(N, d)`, any unit.
        fps: Frames a second [Hz].
        floor: In the unit of the positions.

    Returns:
        For each window, by its first frame, `(N − w,)`.

    Raises:
        DoesNotApply: The episode is not longer than a window.
    """
    width = max(1, round(WINDOW * fps))
    if len(positions) <= width:
        raise DoesNotApply(f"the episode is not longer than {WINDOW} s")
    net = np.linalg.norm(positions[width:] - positions[:-width], axis=1)
    return net < max(floor, SHARE * float(np.percentile(net, 95)))


def idle_share(positions: FloatArray, fps: float, pruned: bool, floor: float = FLOOR) -> float:
    """Return the share of time that is idle.

    Args:
        positions: `(N, d)`, any unit.
        fps: Frames a second [Hz].
        pruned: Leave out the final hold, the idle time at the very end.
        floor: In the unit of the positions.

    Returns:
        The share, 0 to 1. Source: the definition of Handrail's own reference, after the pruning of pauses
        that imitation learning code commonly does.

    Raises:
        DoesNotApply: The episode is not longer than a window, or there is only a final hold.
    """
    idle = idle_windows(positions, fps, floor)
    moving = np.flatnonzero(~idle)
    if pruned:
        if not moving.size:
            raise DoesNotApply("nothing moves")
        idle = idle[: moving[-1] + 1]
    return float(idle.mean())

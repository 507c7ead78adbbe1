"""How well the robot did what it was told, and how restless the commands were."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.missing import DoesNotApply

TOLERANCE = 0.005  # of an entry's range: this close to its end is at the end


def tracking_error(commanded: FloatArray, reached: FloatArray) -> float:
    """Return mean_t ‖a_t − s_{t+1}‖: how far the next state is from what was commanded.

    Args:
        commanded: Entries of the action, `(N, p)`.
        reached: The same entries of the state, in the same units, `(N, p)`.

    Returns:
        The mean norm, in the unit of the entries (velocities of base and joints: [m/s] and [rad/s] together).

    Raises:
        DoesNotApply: There are fewer than two frames.
    """
    if len(commanded) < 2:
        raise DoesNotApply("there are fewer than two frames")
    return float(np.linalg.norm(commanded[:-1] - reached[1:], axis=1).mean())


def saturation(action: FloatArray, low: FloatArray, high: FloatArray) -> float:
    """Return the share of frames in which any entry of the action stays at an end of its range.

    An entry is at an end where it and its neighbour in time are both within 0.5 % of the range of the lowest
    or highest value; entries that never take more than two values, such as a gripper's command, have
    `low = high` and do not count.

    Args:
        action: `(N, a)`.
        low: Lowest value of each entry in all datasets that are compared, `(a,)`.
        high: Highest, `(a,)`.

    Returns:
        The share, 0 to 1. The true limits are not part of LeRobot's format: a limit that was never reached
        is not known.

    Raises:
        DoesNotApply: No entry has a range.
    """
    span = high - low
    if not (span > 0).any():
        raise DoesNotApply("no entry of the action takes more than two values")
    near = np.minimum(np.abs(action - low), np.abs(action - high)) <= TOLERANCE * span
    lower = np.abs(action - low) <= np.abs(action - high)
    at_end = near & (span > 0)
    held = at_end[1:] & at_end[:-1] & (lower[1:] == lower[:-1])
    both = np.zeros(len(action), bool)
    both[1:] |= held.any(axis=1)
    both[:-1] |= held.any(axis=1)
    return float(both.mean())


def variation_ratio(commanded: FloatArray, reached: FloatArray) -> float:
    """Return the total variation of the commands over that of what followed: 1 is a robot that does it all.

    Σ_t ‖a_{t+1} − a_t‖₁ / Σ_t ‖s_{t+1} − s_t‖₁; more than 1 are commands that the robot smoothed away.

    Args:
        commanded: Entries of the action, `(N, p)`.
        reached: The same entries of the state, in the same units, `(N, p)`.

    Raises:
        DoesNotApply: The state never changes.
    """
    changed = float(np.abs(np.diff(reached, axis=0)).sum())
    if not changed:
        raise DoesNotApply("the state never changes")
    return float(np.abs(np.diff(commanded, axis=0)).sum()) / changed

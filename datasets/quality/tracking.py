"""How well the robot did what it was told, and how restless the commands were."""

import numpy as np

from handrail.datasets.quality.metric import metric
from handrail.datasets.quality.scale import Scale
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply

TOLERANCE = 0.005  # of an entry's range: this close to its end is at the end


@metric("unit of the action", "lower", "action")
def tracking_error(episode: Demonstration, scale: Scale) -> float:
    """Distance of the next state from what was commanded.

    mean_t ‖a_t − s_{t+1}‖ over the entries that action and state share, in their unit (velocities of base and
    joints: [m/s] and [rad/s] together).
    """
    if episode.count < 2:
        raise DoesNotApply("there are fewer than two frames")
    return float(np.linalg.norm(episode.commanded[:-1] - episode.reached[1:], axis=1).mean())


@metric("", "lower", "scale")
def saturation(episode: Demonstration, scale: Scale) -> float:
    """Share of time in which an entry of the action stays at the end of its range.

    An entry is at an end where it and its neighbour in time are both within 0.5 % of the range of the lowest
    or highest value in all datasets that are compared; entries that never take more than two values, such as
    a gripper's command, have no range and do not count. The true limits are not part of LeRobot's format: a
    limit that was never reached is not known.
    """
    action, (low, high) = episode.matrix("action"), scale.part("action").range
    span = high - low
    if not (span > 0).any():
        raise DoesNotApply("no entry of the action takes more than two values")
    near = np.minimum(np.abs(action - low), np.abs(action - high)) <= TOLERANCE * span
    lower = np.abs(action - low) <= np.abs(action - high)
    at_end = near & (span > 0)
    held = (at_end[1:] & at_end[:-1] & (lower[1:] == lower[:-1])).any(axis=1)
    return float((np.append(held, False) | np.append(False, held)).mean())


@metric("", "", "action", "action total-variation ratio")
def variation_ratio(episode: Demonstration, scale: Scale) -> float:
    """Total variation of the commands over that of the motion; above 1 the robot smoothed them.

    Σ_t ‖a_{t+1} − a_t‖₁ / Σ_t ‖s_{t+1} − s_t‖₁: 1 is a robot that does it all.
    """
    changed = float(np.abs(np.diff(episode.reached, axis=0)).sum())
    if not changed:
        raise DoesNotApply("the state never changes")
    return float(np.abs(np.diff(episode.commanded, axis=0)).sum()) / changed

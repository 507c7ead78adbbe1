"""How directly something went where it went, phase by phase."""

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.quality.demonstration import Demonstration
from handrail.datasets.quality.metrics import path_length
from handrail.datasets.quality.missing import DoesNotApply

_LOW, _HIGH = 0.25, 0.75  # of the gripper's range: where it counts as closed and as open again
_STILL = 1e-9  # a path shorter than this is no path, in the unit of the motion


def path_efficiency(positions: FloatArray, boundaries: IntArray) -> float:
    """Return straight-line over travelled distance, each phase on its own: 1 is straight, 0 goes nowhere.

    Σ_p ‖x(end_p) − x(start_p)‖ / Σ_p ∫_p ‖dx‖. Source: the straightness index of movement analysis
    (Batschelet 1981), summed over phases so that there-and-back is not zero.

    Args:
        positions: `(N, d)`, any unit.
        boundaries: Frames at which a phase ends and the next begins, `(P,)`, rising.

    Returns:
        The share, 0 to 1.

    Raises:
        DoesNotApply: Nothing moves.
    """
    ends = np.unique(np.concatenate(([0], boundaries, [len(positions) - 1])))
    travelled = path_length(positions)
    if travelled <= _STILL:
        raise DoesNotApply("nothing moves")
    return path_length(positions[ends]) / travelled


def phase_boundaries(demonstration: Demonstration) -> IntArray:
    """Return the frames at which a phase ends and the next begins, `(P,)`.

    Where the recorded phase changes; without one, where the gripper opens or closes; without either or where
    it never does, at the frame that is farthest from the start, so that there-and-back has two phases.
    """
    if demonstration.has("phase"):
        return changes(demonstration.phase)
    try:
        found = changes(gripper_state(demonstration.gripper))
    except DoesNotApply:
        found = np.empty(0, int)
    return found if found.size else farthest(demonstration.motion)


def changes(labels: np.ndarray) -> IntArray:
    """Return the frames whose label differs from the frame before, `(P,)`."""
    return np.flatnonzero(labels[1:] != labels[:-1]) + 1


def gripper_state(opening: FloatArray) -> IntArray:
    """Return 1 where the gripper is open and 0 where closed, `(N,)`.

    Open from 75 % of the range it has in the episode, closed from 25 %, in between as before.
    """
    low, high = opening.min(), opening.max()
    if high - low <= _STILL:
        return np.zeros(len(opening), int)
    share = (opening - low) / (high - low)
    sure = np.where(share >= _HIGH, 1, np.where(share <= _LOW, 0, -1))
    last = np.maximum.accumulate(np.where(sure >= 0, np.arange(len(sure)), -1))
    first = sure[np.flatnonzero(sure >= 0)[0]]
    return np.where(last >= 0, sure[last], first)


def farthest(positions: FloatArray) -> IntArray:
    """Return the frame that is farthest from the first, `(1,)`."""
    return np.array([np.linalg.norm(positions - positions[0], axis=1).argmax()])


def measure(demonstration: Demonstration) -> float:
    """Return the path efficiency of an episode's motion."""
    return path_efficiency(demonstration.motion, phase_boundaries(demonstration))

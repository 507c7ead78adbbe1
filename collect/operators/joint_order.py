"""In which order to move joints one by one, so that nothing is hit on the way."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision import CollisionModel

_SWEEP = np.linspace(0.25, 1.0, 4)  # where on a joint's way one looks whether something is hit


def clear_order(
    collision: CollisionModel, q: FloatArray, goal: FloatArray, joints: list[int], clear: float
) -> list[int]:
    """Return an order of the joints in which each can go all its way, those given first preferred.

    Depth-first over the sets of joints that have been moved; the longest such order if none has them all.

    Args:
        collision: distances in the scene.
        q: to begin with, (n,).
        goal: to end with, (n,); only the joints given move.
        joints: their indices, in the order preferred.
        clear: distance kept on the way [m].
    """
    seen: set[frozenset[int]] = set()
    longest: list[int] = []

    def search(moved: list[int]) -> bool:
        nonlocal longest
        longest = max(longest, moved, key=len)
        if len(moved) == len(joints):
            return True
        seen.add(frozenset(moved))
        now = q.copy()
        now[moved] = goal[moved]
        for joint in joints:
            following = frozenset((*moved, joint))
            if joint in moved or following in seen:
                continue
            free = sweep_clearance(collision, now, joint, goal[joint] - now[joint]) >= clear
            if free and search([*moved, joint]):
                return True
        return False

    search([])
    return longest


def sweep_clearance(collision: CollisionModel, q: FloatArray, joint: int, way: float) -> float:
    """Return the smallest distance to anything while one joint moves [m].

    Args:
        collision: distances in the scene.
        q: to begin with, (n,).
        joint: its index.
        way: how far it goes [m, rad].
    """
    path = np.tile(q, (len(_SWEEP), 1))
    path[:, joint] += _SWEEP * way
    return float(np.min(collision.values(path)))

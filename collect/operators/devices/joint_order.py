"""Where joints belong and in which order to move them one by one, so that nothing is hit on the way."""

import numpy as np

from handrail.collect.operators.devices.arm_solutions import REACHED, arm_solutions
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.robot.model import Pose, RobotModel

_SWEEP = np.linspace(0.25, 1.0, 4)  # where on a joint's way one looks whether something is hit


def plan_joints(
    model: RobotModel, collision: CollisionModel, q: FloatArray, goal: Pose, clear: float
) -> tuple[FloatArray, list[int]]:
    """Return where the joints belong, (n,), and an order in which they can go there, hitting nothing.

    The solution of the inverse kinematics nearest to q if there is an order for it; else the first that has
    one, starting from q with one joint turned by 1.5 rad either way; the most complete if none has.

    Args:
        model: of the robot.
        collision: distances in the scene.
        q: to begin with, (n,).
        goal: of the tool.
        clear: distance kept on the way, less where the robot is nearer at either end [m].
    """
    best, most = (q, list[int]()), -1.0
    arm = list(range(len(model.description.base_joints), model.size))
    at_start = _nearest(collision, q)
    for there, error in arm_solutions(model, q, goal):
        kept = min(clear, 0.9 * at_start, 0.9 * _nearest(collision, there))
        preferred = sorted(arm, key=lambda index: -abs(there[index] - q[index]))
        order = clear_order(collision, q, there, preferred, kept) if kept > 0.0 else []
        share = len(order) / len(arm) - (error > REACHED)
        if share > most:
            best, most = (there, order), share
        if share == 1.0:
            break
    return best


def _nearest(collision: CollisionModel, q: FloatArray) -> float:
    return float(np.min(collision.values(q[None, :])))


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

"""The joint angles that put the tool at a pose: the nearest ones first, then others of the same arm."""

from collections.abc import Iterator

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.robot.inverse_kinematics import arm_configuration
from handrail.controllers.robot.model import Pose, RobotModel

REACHED = 0.01  # largest error of a solution [m, rad]
_TURNS = (1.5, -1.5)  # of one joint from where it is, to look for another solution from [rad]
_WAY = np.linspace(0.1, 1.0, 10)[:, None]  # where on a straight way one looks whether something is hit


def arm_solutions(model: RobotModel, q: FloatArray, goal: Pose) -> Iterator[tuple[FloatArray, float]]:
    """Yield configurations that bring the tool to the goal, (n,), and the error that each leaves.

    Args:
        model: of the robot.
        q: to begin with, (n,); later searches begin with one arm joint turned by 1.5 rad either way.
        goal: of the tool.
    """
    yield arm_configuration(model, q, goal)
    for joint in range(len(model.description.base_joints), model.size):
        for angle in _TURNS:
            start = q.copy()
            start[joint] += angle
            yield arm_configuration(model, start, goal)


def straight_solution(
    model: RobotModel, collision: CollisionModel, q: FloatArray, goal: Pose, clear: float
) -> FloatArray:
    """Return the first solution that all joints can go straight to at once, hitting nothing, (n,).

    The one whose way keeps the largest distance if none keeps `clear`; the nearest configuration if the arm
    does not reach the goal.

    Args:
        model: of the robot.
        collision: distances in the scene.
        q: to begin with, (n,).
        goal: of the tool.
        clear: distance kept on the way [m].
    """
    best, widest = None, -np.inf
    for there, error in arm_solutions(model, q, goal):
        kept = float(np.min(collision.values(q + _WAY * (there - q)))) if error < REACHED else -np.inf
        if best is None or kept > widest:
            best, widest = there, kept
        if kept >= clear:
            break
    return q if best is None else best

"""The joint angles that put the tool at a pose: the nearest first."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.robot.inverse_kinematics import arm_configuration
from handrail.controllers.robot.model import Pose, RobotModel

REACHED = 0.01  # largest error of a solution [m, rad]
_TURNS = (1.5, -1.5)  # of one joint from where it is, to look for another solution from [rad]
_WAY = np.linspace(0.1, 1.0, 10)[:, None]  # where on a straight way one looks whether something is hit


def arm_solutions(model: RobotModel, q: FloatArray, goal: Pose) -> list[tuple[FloatArray, float]]:
    """Return configurations that bring the tool to the goal, (n,), and the error that each leaves.

    By `‖q_ik − q‖`, the smallest first; those that do not reach the goal come last, by their error. A joint
    that can turn more than once around is taken the shorter way.

    Args:
        model: of the robot.
        q: to begin with, (n,); searches begin there, with each arm joint turned by 1.5 rad either way, and at
            home.
        goal: of the tool.
    """
    base = len(model.description.base_joints)
    starts = [q, np.concatenate([q[:base], model.description.home[base:]])]
    for joint in range(base, model.size):
        starts += [q + angle * (np.arange(model.size) == joint) for angle in _TURNS]
    found = [arm_configuration(model, start, goal) for start in starts]
    unwound = [(_unwound(model, q, there), error) for there, error in found]

    def order(solution: tuple[FloatArray, float]) -> tuple[bool, float]:
        there, error = solution
        missed = error >= REACHED
        return missed, error if missed else float(np.linalg.norm(there - q))

    return sorted(unwound, key=order)


def straight_solution(
    model: RobotModel, collision: CollisionModel, q: FloatArray, goal: Pose, clear: float
) -> FloatArray:
    """Return the nearest solution that all joints can go straight to at once, hitting nothing, (n,).

    The one whose way keeps the largest distance if none keeps `clear`; the one that comes nearest if the arm
    does not reach the goal.

    Args:
        model: of the robot.
        collision: distances in the scene.
        q: to begin with, (n,).
        goal: of the tool.
        clear: distance kept on the way [m].
    """
    solutions = arm_solutions(model, q, goal)
    best, widest = solutions[0][0], -np.inf
    for there, error in solutions:
        kept = float(np.min(collision.values(q + _WAY * (there - q)))) if error < REACHED else -np.inf
        if kept > widest:
            best, widest = there, kept
        if kept >= clear:
            break
    return best


def _unwound(model: RobotModel, q: FloatArray, there: FloatArray) -> FloatArray:
    """Return the same pose of the arm with each joint turned the shorter way, where its limits allow that."""
    limits, base = model.description.limits, len(model.description.base_joints)
    shorter = q + (there - q + np.pi) % (2.0 * np.pi) - np.pi
    allowed = (limits.position_lower <= shorter) & (shorter <= limits.position_upper)
    return np.where(allowed & (np.arange(model.size) >= base), shorter, there)

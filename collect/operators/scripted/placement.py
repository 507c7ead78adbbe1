"""Where a person would park the base, and where the arm's joints would belong."""

import numpy as np
from numpy.typing import ArrayLike

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.inverse_kinematics import arm_configuration, body_configuration
from handrail.controllers.robot.model import Pose, RobotModel

REACHED = 0.01  # largest error of a solution [m, rad]
_TURNS = (1.5, -1.5)  # of one joint from where it is, to look for another solution from [rad]
_WAY = np.linspace(0.1, 1.0, 10)[:, None]  # where on a straight way one looks whether something is hit
_COMFORT = 0.85  # of the reach at home
_YAWS = (0.0, 0.5, -0.5, 1.0, -1.0, 1.5, -1.5)  # in which a person would try to stand [rad]
_FARTHER = (_COMFORT, 0.95, 1.05, 1.1, 1.15, 0.75)  # shares of it to try, the first that will do
_ABOUT = 0.05  # error of the hand's pose there that a person puts up with [m, rad]
_SELF_CLEAR = 0.08  # of the arm to itself that is enough, at scale 1 [m]
_UPRIGHT = 0.2  # horizontal part of where the hand points, below which its heading does not matter


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
    base = len(model.description.base.joints)
    moving = model.moving & (np.arange(model.size) >= base)
    turns = (angle * axis for axis in np.eye(model.size)[moving] for angle in _TURNS)
    starts = [q, np.concatenate([q[:base], model.description.home[base:]]), *(q + turn for turn in turns)]
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
        kept = nearest(collision, q + _WAY * (there - q)) if error < REACHED else -np.inf
        if kept > widest:
            best, widest = there, kept
        if kept >= clear:
            break
    return best


def _unwound(model: RobotModel, q: FloatArray, there: FloatArray) -> FloatArray:
    """Return the same pose of the arm with each joint turned the shorter way, where its limits allow that."""
    limits, base = model.description.limits, len(model.description.base.joints)
    shorter = q + (there - q + np.pi) % (2.0 * np.pi) - np.pi
    allowed = (limits.position_lower <= shorter) & (shorter <= limits.position_upper)
    return np.where(allowed & (np.arange(model.size) >= base), shorter, there)


def nearest(collision: CollisionModel, q: FloatArray) -> float:
    """Return the smallest distance at configurations, (n,) or (k, n) [m]."""
    return float(np.min(collision.values(np.atleast_2d(q))))


def standing_point(
    model: RobotModel, place: ArrayLike, yaw: float = 0.0, comfort: float = _COMFORT
) -> FloatArray:
    """Return the base pose (x, y, θ) that has a place as far ahead as the tool is at home, a little nearer.

    The tool's offset from the base at home, turned by the yaw and shortened, is taken from the place; the
    result stays inside the position limits. A robot with a fixed base stands where it stands: (0, 0, 0).
    """
    description = model.description
    if not description.base.joints:
        return np.zeros(3)
    x, y, theta = description.home[:3]
    tool = model.pose(description.home).position[:2] - [x, y]
    offset = turned(np.eye(2), yaw - theta) @ tool
    spot = np.asarray(place, dtype=float)[:2] - comfort * offset
    lower, upper = description.limits.position_lower[:2], description.limits.position_upper[:2]
    return np.array([*np.clip(spot, lower, upper), yaw])


def standing_within_reach(model: RobotModel, q: FloatArray, goal: Pose, yaw: float) -> FloatArray:
    """Return a base pose (x, y, θ) with a heading from which the arm gets the hand to a pose.

    At the comfortable distance if the arm reaches it there, else farther or nearer; the comfortable one if it
    reaches it from none.

    Args:
        model: of the robot.
        q: now, (n,).
        goal: of the tool.
        yaw: heading of the base [rad].
    """
    stands = [standing_point(model, goal.position, yaw, comfort) for comfort in _FARTHER]
    if not model.description.base.joints:
        return stands[0]
    for stand in stands:
        if arm_configuration(model, np.concatenate([stand, q[3:]]), goal)[1] <= _ABOUT:
            return stand
    return stands[0]


def standing_pose(model: RobotModel, q: FloatArray, goal: Pose) -> FloatArray:
    """Return where a person would park the base to bring the hand to a pose, (x, y, θ).

    The first heading at `standing_point` from which the arm, as it is now, gets there without coming near
    itself; the one that comes nearest to that if none does.

    Args:
        model: of the robot.
        q: now, (n,).
        goal: of the tool.
    """
    if not model.description.base.joints:
        return np.zeros(3)
    if np.count_nonzero(model.moving) < 6 + len(model.description.base.joints):
        return _standing_in_line(model, q, goal)
    collision, best, fewest = CollisionModel(model), standing_point(model, goal.position), np.inf
    clear = _SELF_CLEAR * model.description.world.scale
    for yaw in _YAWS:
        stand = standing_point(model, goal.position, yaw)
        there, error = arm_configuration(model, np.concatenate([stand, q[3:]]), goal)
        lack = max(clear - nearest(collision, there), 0.0) + 10.0 * (error > REACHED)
        if lack < fewest:
            best, fewest = stand, lack
        if not lack:
            break
    return best


def _standing_in_line(model: RobotModel, q: FloatArray, goal: Pose) -> FloatArray:
    """Return where the base of an arm that points only away from its foot has to stand, (x, y, θ)."""
    away = goal.rotation[:2, 2]
    yaw = float(np.arctan2(away[1], away[0])) if np.linalg.norm(away) > _UPRIGHT else float(q[2])
    behind = np.concatenate([standing_point(model, goal.position, yaw), model.description.home[3:]])
    return body_configuration(model, behind, goal)[0][:3]

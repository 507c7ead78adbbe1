"""A posture to begin in: the hands ahead and half down, clear, away from limits and singularities."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.modelling.pairs import configurations
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.inverse_kinematics import hands_configuration
from handrail.controllers.robot.model import Pose, RobotModel, joints_of
from handrail.controllers.robot.urdf import chain

_TRIES, _REACHES = 300, 500
_EDGE = 0.4  # of a range that home keeps from [rad]
_ERROR = 1e-3  # of the hands' poses [m, rad]
_CLEAR, _ROOM, _FREE = 0.12, 0.6, 0.3  # enough: distance at scale 1 [m], to a limit [rad], singular value


def find_home(model: RobotModel, reach: float, rng: np.random.Generator) -> FloatArray:
    """Return the best of random postures, (n,), by its worst: distances, room to the limits, manipulability.

    Args:
        model: of the robot, its pairs in it.
        reach: of a hand from its shoulder [m].
        rng: drawn from.
    """
    limits, collision = model.description.limits, CollisionModel(model)
    edge = np.minimum((limits.position_upper - limits.position_lower) / 6.0, _EDGE)
    lower, upper = limits.position_lower + edge, limits.position_upper - edge
    inside = replace(limits, position_lower=lower, position_upper=upper)
    home = np.clip(model.description.home, lower, upper)
    narrow = RobotModel(replace(model.description, limits=inside, home=home))
    found = [_posture(narrow, reach, rng) for _ in range(_TRIES)]
    postures = [q for q in found if q is not None] or [home]
    return max(postures, key=lambda q: _quality(model, collision, q, reach))


def freedom(model: RobotModel, q: FloatArray, reach: float) -> tuple[float, float]:
    """Return how far the hands' joints are from a limit [rad], and the least singular value of a hand.

    A joint that slides has as much room in the middle half of its range as one that turns has at 0.6 rad.
    That is of `(J_v / reach, J_ω)`, (6, n), of the arm alone; of its five where an arm has five joints.
    """
    limits, base = model.description.limits, len(model.description.base.joints)
    slides = np.array([joint.prismatic for joint in joints_of(model)])
    enough = np.where(slides, (limits.position_upper - limits.position_lower) / 4.0, _ROOM)
    ends = np.minimum(q - limits.position_lower, limits.position_upper - q) * (_ROOM / enough)
    free, room, scale = [], [], np.repeat([reach, 1.0], 3)[:, None]
    for hand in (model.with_hand(hand.name) for hand in model.description.hands):
        arm = hand.moving & (np.arange(model.size) >= base)
        free.append(np.linalg.svd(hand.jacobian(q)[:, arm] / scale, compute_uv=False).min())
        room.append(ends[arm].min(initial=np.inf))
    return float(min(room)), float(min(free))


def shoulder_place(model: RobotModel, hand: int, q: FloatArray) -> FloatArray:
    """Return where an arm begins [m], (3,)."""
    return model.pose(q, _shoulder(model, hand)).position


@lru_cache(maxsize=8)
def _shoulder(model: RobotModel, hand: int) -> str:
    """Return the joint that an arm begins with: the first that turns and moves no other hand."""
    arms, hands = model.description.arms, model.description.hands
    chains = [[joint for joint in chain(arms, each.frame) if joint in model.joints] for each in hands]
    own = [joint for joint in chains[hand] if sum(joint in each for each in chains) == 1]
    turning = [joint for joint in own if not joints_of(model)[model.joints.index(joint)].prismatic]
    return (turning or own)[-1]


def reach_of(model: RobotModel, rng: np.random.Generator) -> float:
    """Return how far every hand gets from its shoulder in random postures [m]."""
    postures, reaches = configurations(model, _REACHES, rng), []
    for number, hand in enumerate(model.description.hands):
        own = model.with_hand(hand.name)
        ways = [own.pose(q).position - shoulder_place(model, number, q) for q in postures]
        reaches.append(float(np.linalg.norm(ways, axis=1).max()))
    return min(reaches)


def _quality(model: RobotModel, collision: CollisionModel, q: FloatArray, reach: float) -> float:
    """Return how good a posture is: 1 where nothing is to be wished for, below 0 where shapes meet."""
    margins = np.minimum(collision.largest_margin, _CLEAR * model.description.world.scale)
    clear = float(np.min(collision.values(q[None])[0] / np.maximum(margins, 1e-3), initial=1.0))
    room, free = freedom(model, q, reach)
    return min(clear, room / _ROOM, free / _FREE, 1.0) + 0.1 * min(room, 1.0) + 0.1 * free


def _posture(model: RobotModel, reach: float, rng: np.random.Generator) -> FloatArray | None:
    """Return a random posture with every hand ahead of its shoulder, mirrored; None where it gets none."""
    robot = model.description
    limits, hands = robot.limits, [model.with_hand(hand.name) for hand in robot.hands]
    middle = (limits.position_lower + limits.position_upper) / 2
    half = np.minimum(limits.position_upper - middle, np.pi)
    moved = np.any([hand.moving for hand in hands], axis=0)
    q = np.where(moved, rng.uniform(middle - half, middle + half), robot.home)
    q[: len(robot.base.joints)] = robot.home[: len(robot.base.joints)]
    ahead, aside, up = reach * rng.uniform([0.45, -0.1, -0.3], [0.8, 0.25, 0.1])
    pitch, roll = rng.uniform(0.2, 1.2), rng.uniform(-np.pi, np.pi)
    goals = []
    for number in range(len(hands)):
        origin = shoulder_place(model, number, robot.home)
        side = np.sign(origin[1]) if len(hands) > 1 else 1.0
        z = np.clip(origin[2] + up, *robot.world.goals)
        turned = matrix_from_rpy([0.0, np.pi / 2 + pitch, 0.0]) @ matrix_from_rpy([0.0, 0.0, side * roll])
        goals.append(Pose(np.array([origin[0] + ahead, origin[1] + side * aside, z]), turned))
    q, error = hands_configuration(model, q, goals)
    return q if error < _ERROR else None

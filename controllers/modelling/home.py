"""A posture to begin in: the hands ahead and half down, clear, away from limits and singularities."""

from dataclasses import replace

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.modelling.pairs import configurations
from handrail.controllers.numerics.rotation import matrix_from_rpy, matrix_from_vector
from handrail.controllers.robot.description import RobotDescription
from handrail.controllers.robot.inverse_kinematics import arm_configuration
from handrail.controllers.robot.model import Pose, RobotModel, joints_of
from handrail.controllers.robot.urdf import chain

_TRIES, _ROUNDS, _REACHES = 300, 3, 500
_EDGE = 0.4  # of a range that home keeps from [rad]
_ERROR = 1e-3  # of the hands' poses [m, rad]
_CLEAR, _ROOM, _FREE = (
    0.12,
    0.6,
    0.3,
)  # that are enough: distance at scale 1 [m], to a limit [rad], singular value


def find_home(model: RobotModel, reach: float, rng: np.random.Generator) -> FloatArray:
    """Return the best of random postures, (n,), by its worst: distances, room to the limits, manipulability.

    Args:
        model: of the robot, its pairs in it.
        reach: of a hand from its shoulder [m].
        rng: drawn from.
    """
    collision, narrow = CollisionModel(model), RobotModel(_narrowed(model.description))
    hands = [narrow.with_hand(hand.name) for hand in model.description.hands]
    places = [shoulder_place(model, number, model.description.home) for number in range(len(hands))]
    best, highest = np.array(model.description.home), -np.inf
    for _ in range(_TRIES):
        q = _posture(narrow, hands, places, reach, rng)
        if q is not None and (score := quality(model, collision, q, reach)) > highest:
            best, highest = q, score
    return best


def quality(model: RobotModel, collision: CollisionModel, q: FloatArray, reach: float) -> float:
    """Return how good a posture is: 1 where nothing is to be wished for, below 0 where shapes meet."""
    margins = np.minimum(collision.largest_margin, _CLEAR * model.description.world.scale)
    clear = float(np.min(collision.values(q[None])[0] / np.maximum(margins, 1e-3), initial=1.0))
    room, free = freedom(model, q, reach)
    return min(clear, room / _ROOM, free / _FREE, 1.0) + 0.1 * min(room, 1.0) + 0.1 * free


def freedom(model: RobotModel, q: FloatArray, reach: float) -> tuple[float, float]:
    """Return how far the hands' joints are from a limit [rad], and the least singular value of a hand.

    A joint that slides has as much room in the middle half of its range as one that turns has at 0.6 rad.
    That is of `(J_v / reach, J_ω)`, (6, n), of the arm alone; of its five where an arm has five joints.
    """
    limits, base = model.description.limits, len(model.description.base.joints)
    free, room = np.inf, np.inf
    for hand in (model.with_hand(hand.name) for hand in model.description.hands):
        arm = hand.moving & (np.arange(model.size) >= base)
        J = hand.jacobian(q)[:, arm] / np.array([*[reach] * 3, *[1.0] * 3])[:, None]
        free = min(free, float(np.linalg.svd(J, compute_uv=False)[min(6, J.shape[1]) - 1]))
        slides = np.array([joint.prismatic for joint in joints_of(model)])
        enough = np.where(slides, (limits.position_upper - limits.position_lower) / 4.0, _ROOM)
        ends = np.minimum(q - limits.position_lower, limits.position_upper - q) * (_ROOM / enough)
        room = min(room, float(ends[arm].min(initial=np.inf)))
    return room, free


def shoulder(model: RobotModel, hand: int) -> int:
    """Return the joint that an arm begins with: the first that turns and moves no other hand."""
    description = model.description
    others = {
        j
        for k, each in enumerate(description.hands)
        if k != hand
        for j in chain(description.arms, each.frame)
    }
    own = [
        j
        for j in chain(description.arms, description.hands[hand].frame)
        if j not in others and j in model.joints
    ]
    kinds, number = joints_of(model), model.pinocchio.getJointId
    turning = [joint for joint in own if not kinds[number(joint) - 1].prismatic]
    return number((turning or own)[-1])


def _narrowed(robot: RobotDescription) -> RobotDescription:
    """Return a robot whose joints keep from their ends: by a sixth of their range, at most 0.4 rad."""
    limits = robot.limits
    edge = np.minimum((limits.position_upper - limits.position_lower) / 6.0, _EDGE)
    lower, upper = limits.position_lower + edge, limits.position_upper - edge
    inside = replace(limits, position_lower=lower, position_upper=upper)
    return replace(robot, limits=inside, home=np.clip(robot.home, lower, upper))


def _posture(
    model: RobotModel,
    hands: list[RobotModel],
    places: list[FloatArray],
    reach: float,
    rng: np.random.Generator,
) -> FloatArray | None:
    """Return a random posture with every hand ahead of its shoulder, mirrored; None where it gets none."""
    limits, home = model.description.limits, model.description.home
    middle = (limits.position_lower + limits.position_upper) / 2
    draw = rng.uniform(
        np.maximum(limits.position_lower, middle - np.pi), np.minimum(limits.position_upper, middle + np.pi)
    )
    moved = np.any([hand.moving for hand in hands], axis=0) & (
        np.arange(model.size) >= len(model.description.base.joints)
    )
    q = np.where(moved, draw, home)
    ahead, aside, up = reach * rng.uniform([0.45, -0.1, -0.3], [0.8, 0.25, 0.1])
    pitch, roll = rng.uniform(0.2, 1.2), rng.uniform(-np.pi, np.pi)
    goals = []
    for origin in places:
        side = np.sign(origin[1]) if len(hands) > 1 else 1.0
        z = np.clip(origin[2] + up, *model.description.world.goals)
        forward = matrix_from_rpy([0.0, np.pi / 2 + pitch, 0.0])
        turned = forward @ matrix_from_vector([0.0, 0.0, side * roll])
        goals.append(Pose(np.array([origin[0] + ahead, origin[1] + side * aside, z]), turned))
    for _ in range(_ROUNDS):  # arms that share a torso move it in turns
        errors = []
        for hand, goal in zip(hands, goals, strict=True):
            q, error = arm_configuration(hand, q, goal)
            errors.append(error)
        reached = [
            np.linalg.norm(h.pose(q).position - g.position) < _ERROR
            for h, g in zip(hands, goals, strict=True)
        ]
        if max(errors) < _ERROR and all(reached):
            return q
    return None


def reach_of(model: RobotModel, number: int, rng: np.random.Generator) -> float:
    """Return how far a hand gets from its shoulder in random postures [m]."""
    hand, begin = (
        model.with_hand(model.description.hands[number].name),
        model.pinocchio.names[shoulder(model, number)],
    )
    postures = configurations(model, _REACHES, rng)
    return max(float(np.linalg.norm(hand.pose(q).position - hand.pose(q, begin).position)) for q in postures)


def shoulder_place(model: RobotModel, hand: int, q: FloatArray) -> FloatArray:
    """Return where an arm begins [m], (3,)."""
    return model.pose(q, model.pinocchio.names[shoulder(model, hand)]).position

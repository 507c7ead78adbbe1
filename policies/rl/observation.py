"""Observation and action of the reinforcement-learning policy: 54 numbers in the base frame, a base twist."""

from collections.abc import Sequence

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import RobotModel
from handrail.policies.rl.catalogue import CONTROLLER, ROBOT

OBSERVATION_SIZE = 54
ACTION_SIZE = 3
BASE_SPEED = np.array([0.4, 0.4, 0.75])  # of a full action: vx, vy [m/s], ωz [rad/s]

RigidPose = tuple[FloatArray, FloatArray]  # position (3,) [m], rotation (3, 3)


def check_robot(model: RobotModel) -> None:
    """Check that a robot is of the kind that the actor was trained on."""
    if not CONTROLLER.fits(model.description):
        name = model.description.name
        raise HandrailError(f"robot {name} of the learnt baseline: expected the joints and arm of {ROBOT}")


def observe(
    q: FloatArray, start: FloatArray, twist: FloatArray, poses: Sequence[RigidPose], previous: FloatArray
) -> FloatArray:
    """Return the observation: twist 6, poses 3 × (3 + 9), base since the start 3, arm 6, previous action 3.

    Everything but the base coordinates is in the frame of the base, and these are relative to the base's
    first pose, so that an observation does not change when robot and goal are moved or turned together.

    Args:
        q: generalised coordinates, planar base first, (n,).
        start: base coordinates at the beginning of the episode, (3,).
        twist: commanded tool twist, world-aligned, (6,) [m/s, rad/s].
        poses: of the tool in the world, three: now, where the commands so far would have brought it, and
            where they lead.
        previous: action before, (3,).
    """
    to_base, origin = turned(np.eye(3), -q[2]), np.array([q[0], q[1], 0.0])
    parts = [(twist.reshape(2, 3) @ to_base.T).ravel()]
    for position, rotation in poses:
        parts += [to_base @ (position - origin), (to_base @ rotation).ravel()]
    travelled = turned(np.eye(2), -start[2]) @ (q[:2] - start[:2])
    parts += [travelled, [q[2] - start[2]], q[3:], previous]
    return np.concatenate(parts)


def conditioning() -> FloatArray:
    """Return P of `z = P o`: the observation as the networks are trained on it, (54, 54).

    The twist and the way from the current to the desired pose are small beside the other numbers and matter
    most: they are enlarged, and desired and goal pose become differences from the current one. P can be
    undone, so nothing is added or lost; a trained actor takes it into its first layer.
    """
    scale = np.concatenate([np.full(3, 10.0), np.full(3, 3.0), np.ones(OBSERVATION_SIZE - 6)])
    scale[18:30] = np.repeat([10.0, 5.0], [3, 9])
    difference = np.eye(OBSERVATION_SIZE)
    difference[18:30, 6:18] = difference[30:42, 6:18] = -np.eye(12)
    return scale[:, None] * difference


def base_velocity(action: FloatArray, angle: float) -> FloatArray:
    """Return the base coordinates' velocity of an action, in the world frame, (3,) [m/s, rad/s].

    Args:
        action: in [−1, 1], (3,), in the base frame.
        angle: of the base [rad].
    """
    return turned(np.eye(3), angle) @ (BASE_SPEED * np.clip(action, -1.0, 1.0))

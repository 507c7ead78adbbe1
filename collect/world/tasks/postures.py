"""Postures that tasks begin with, and how hands are turned there."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.inverse_kinematics import hands_configuration
from handrail.controllers.robot.model import Pose, RobotModel

_LAID_OUT = 1.49  # of the tool ahead of the base's centre at home [m]


def near_home(model: RobotModel, rng: np.random.Generator) -> FloatArray:
    """Return home with noise within limits: 10 cm · scale, 0.15 rad, 0.05 rad in the arm's joints, (n,)."""
    base, away = len(model.description.base.joints), 0.10 * model.description.world.scale
    spread = np.concatenate([np.array([away, away, 0.15])[:base], np.full(model.size - base, 0.05)])
    q, limits = model.description.home + rng.uniform(-spread, spread), model.description.limits
    return np.clip(q, limits.position_lower, limits.position_upper)


def reach_share(model: RobotModel) -> float:
    """Return how far the tool is from the base at home, as a share of 1.49 m, at most 1."""
    home = model.description.home
    away = model.pose(home).position[:2] - model.pose(home, "planar_base").position[:2]
    return min(1.0, float(np.linalg.norm(away)) / _LAID_OUT)


def side_by_side(model: RobotModel, q: FloatArray, middle: Pose, apart: float) -> tuple[FloatArray, float]:
    """Return q with two hands beside a pose, each on the side along its y where it is, and the error left.

    Args:
        model: of the robot.
        q: to begin with, (n,).
        middle: half-way between the hands, turned as both.
        apart: distance between them [m].
    """
    y, hands = middle.rotation[:, 1], model.description.hands
    sides = [np.sign((model.pose(q, hand.named("tool")).position - middle.position) @ y) for hand in hands]
    goals = [Pose(middle.position + 0.5 * apart * side * y, middle.rotation) for side in sides]
    return hands_configuration(model, q, goals)


def hand_rotation(x: ArrayLike, z: ArrayLike) -> FloatArray:
    """Return the rotation of a hand that points along z and opens along x, unit vectors, (3, 3)."""
    x, z = np.asarray(x), np.asarray(z)
    return np.column_stack([x, np.cross(z, x), z])


def nearest_rotation(tool: FloatArray, rotations: Iterable[FloatArray]) -> FloatArray:
    """Return the one of some rotations that is nearest to the tool's, (3, 3)."""
    return max(rotations, key=lambda rotation: float(np.trace(rotation.T @ tool)))

"""Limits of a robot's joints: the URDF's, and what is sensible where it says none."""

from typing import Any

import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel, joints_of

FASTEST = (7.0, 1.5)  # sensible velocity of a joint that turns, and of one that slides [rad/s, m/s]
LIMITS = ("position_lower", "position_upper", "velocity", "acceleration", "effort", "servo")
_VELOCITY, _ACCELERATION = (1.5, 0.1), (5.0, 2.0)  # where none is said, and the largest that is guessed
_EFFORT = (400.0, 20_000.0)  # largest [N m, N]
_SOON = 0.5  # time to full velocity that is guessed [s]
_SPARE = 0.5  # share of the effort that accelerating may take
_SERVO_TIME = 0.003  # of a velocity servo [s]
_DRIVE_TIME = 0.0025  # of what collect/world/robot.py adds to it [s]
_POSES = 30


def arm_limits(tables: dict[str, Any], model: RobotModel, rng: np.random.Generator) -> list[str]:
    """Write the limits of an arm into the tables; return guesses.

    Acceleration: `a = min(2 v, 5, ½ τ / I)`, full velocity in 0.5 s, and what half of the effort can do,
    I the largest inertia that the joint sees.
    """
    robot, base = model.pinocchio, len(model.description.base.joints)
    slides = np.array([joint.prismatic for joint in joints_of(model)], dtype=bool)
    velocity, effort = robot.velocityLimit.copy(), robot.effortLimit.copy()
    said, kinds = [], (("velocity", velocity, FASTEST, _VELOCITY), ("effort", effort, _EFFORT, _EFFORT))
    for name, values, most, instead in kinds:
        odd = ~((values > 0.0) & (values <= np.where(slides, *most[::-1])))
        guess = np.where(slides, *instead[::-1])
        rows = [k for k in np.flatnonzero(odd) if k >= base]
        said += [f"{name} of {model.joints[k]}: {guess[k]:.6g}, the URDF says {values[k]:.6g}" for k in rows]
        values[odd] = guess[odd]
    inertia = _inertias(model, rng)
    servo = np.maximum(np.where(slides, 10.0, 5.0) * effort, inertia / _SERVO_TIME)
    able = np.maximum(_SPARE * effort / (inertia + _DRIVE_TIME * servo), 0.2 * velocity)
    acceleration = np.minimum.reduce([velocity / _SOON, np.where(slides, *_ACCELERATION[::-1]), able])
    guessed = ", ".join(f"{model.joints[k]} {acceleration[k]:.2g}" for k in range(base, model.size))
    ends = robot.lowerPositionLimit, robot.upperPositionLimit
    for name, values in zip(LIMITS, (*ends, velocity, acceleration, effort, servo), strict=True):
        tables["limits"][name][base:] = values[base:]
    return [*said, f"accelerations: guessed, a URDF says none: {guessed}"]


def base_limits(tables: dict[str, Any], model: RobotModel) -> None:
    """Write the limits of a base that drives: full velocity in 1 s, servos that hold its mass."""
    scale = tables["world"]["scale"]
    mass = tables["base"]["mass"] + sum(inertia.mass for inertia in model.pinocchio.inertias)
    arm, speed = np.square([1.0, 1.0, 0.5 * scale + 0.2]), [scale, scale, 0.8]
    ends = np.array([3.0, 3.0, 2.0 * np.pi])
    values = -ends, ends, speed, speed, 10.0 * mass * arm, 200.0 * mass * arm
    base = len(model.description.base.joints)
    for name, each in zip(LIMITS, values, strict=True):
        tables["limits"][name][:base] = each[:base]


def _inertias(model: RobotModel, rng: np.random.Generator) -> FloatArray:
    """Return the largest inertia that each joint sees over random postures, (n,)."""
    robot, data = model.pinocchio, model.pinocchio.createData()
    ends = np.array([robot.lowerPositionLimit, robot.upperPositionLimit])
    lower, upper = np.sort(np.where((np.abs(ends) < 1e3).all(axis=0), ends, 0.0), axis=0)
    postures = rng.uniform(lower, upper, (_POSES, model.size))
    return np.max([np.diag(pin.crba(robot, data, q)) for q in postures], axis=0)

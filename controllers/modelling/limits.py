"""Limits of a robot's joints: the URDF's, and what is sensible where it says none."""

from typing import Any

import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel, joints_of
from handrail.controllers.robot.parts import Arm
from handrail.controllers.robot.urdf import check_urdf

FASTEST = (7.0, 1.5)  # sensible velocity of a joint that turns, and of one that slides [rad/s, m/s]
_VELOCITY, _ACCELERATION = (1.5, 0.1), (5.0, 2.0)  # where none is said, and the largest that is guessed
_EFFORT = (400.0, 20_000.0)  # largest [N m, N]
_SOON = 0.5  # time to full velocity that is guessed [s]
_SPARE = 0.5  # share of the effort that accelerating may take
_SERVO_TIME, _DRIVE_TIME = (
    0.003,
    0.0025,
)  # of a velocity servo, and of what collect/world/robot.py adds to it [s]
_POSES = 30


def arm_limits(
    model: RobotModel, arm: Arm, rng: np.random.Generator
) -> tuple[dict[str, list[float]], list[str]]:
    """Return limits by name, one a joint of the arm, and guesses.

    Acceleration, where the URDF has none: `a = min(2 v, 5, ½ τ / I)`, full velocity in 0.5 s, and what half
    of the effort can do, I the largest inertia that the joint sees.
    """
    robot, base, said = model.pinocchio, len(model.description.base.joints), []
    extra = {
        joint.get("name", ""): limit.get("acceleration", "")
        for joint in check_urdf(arm.urdf).findall("joint")
        if (limit := joint.find("limit")) is not None
    }
    found: dict[str, list[float]] = {
        name: []
        for name in ("position_lower", "position_upper", "velocity", "acceleration", "effort", "servo")
    }
    inertias = _inertias(model, rng)
    for index in range(base, model.size):
        slides, name = int(joints_of(model)[index].prismatic), model.joints[index]
        velocity, effort = float(robot.velocityLimit[index]), float(robot.effortLimit[index])
        if not 0.0 < velocity <= FASTEST[slides]:
            said.append(f"velocity of {name}: {_VELOCITY[slides]}, the URDF says {velocity:.6g}")
            velocity = _VELOCITY[slides]
        effort = min(effort, _EFFORT[slides]) if effort > 0.0 else _EFFORT[slides]
        inertia = inertias[index]
        servo = max((5.0, 10.0)[slides] * effort, inertia / _SERVO_TIME)
        able = _SPARE * effort / (inertia + _DRIVE_TIME * servo)
        acceleration = float(
            extra.get(name) or min(velocity / _SOON, _ACCELERATION[slides], max(able, 0.2 * velocity))
        )
        values = (
            robot.lowerPositionLimit[index],
            robot.upperPositionLimit[index],
            velocity,
            acceleration,
            effort,
            servo,
        )
        for key, value in zip(found, values, strict=True):
            found[key].append(float(value))
    guessed = [
        f"{name} {value:.2g}"
        for name, value in zip(model.joints[base:], found["acceleration"], strict=True)
        if not extra.get(name)
    ]
    if guessed:
        said.append(f"accelerations: guessed, the URDF says none: {', '.join(guessed)}")
    return found, said


def base_limits(tables: dict[str, Any], model: RobotModel) -> None:
    """Write the limits of a base: full velocity in 1 s, servos that hold its mass."""
    scale = tables["world"]["scale"]
    mass = tables["base"]["mass"] + sum(inertia.mass for inertia in model.pinocchio.inertias)
    arm = np.square([1.0, 1.0, 0.5 * scale + 0.2])
    for name, values in {
        "velocity": [scale, scale, 0.8],
        "acceleration": [scale, scale, 0.8],
        "effort": 10.0 * mass * arm,
        "servo": 200.0 * mass * arm,
        "position_lower": [-3.0, -3.0, -2.0 * np.pi],
        "position_upper": [3.0, 3.0, 2.0 * np.pi],
    }.items():
        tables["limits"][name][:3] = values


def _inertias(model: RobotModel, rng: np.random.Generator) -> FloatArray:
    """Return the largest inertia that each joint sees over random postures, (n,)."""
    robot, data, q = model.pinocchio, model.pinocchio.createData(), pin.neutral(model.pinocchio)
    lower, upper = robot.lowerPositionLimit, robot.upperPositionLimit
    bounded = (lower > -1e3) & (upper < 1e3)
    most = np.zeros(model.size)
    for _ in range(_POSES):
        q = np.where(bounded, rng.uniform(np.where(bounded, lower, 0.0), np.where(bounded, upper, 1.0)), 0.0)
        most = np.maximum(most, np.diag(pin.crba(robot, data, q)))
    return most

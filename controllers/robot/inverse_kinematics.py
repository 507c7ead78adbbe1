"""Inverse kinematics of the arm, the base standing still: which joints put the tool where it shall be."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import rotation_vector
from handrail.controllers.robot.model import Pose, RobotModel

_DAMPING = 1e-4
_LARGEST_STEP = 0.1  # [rad]
_STEPS = 100  # those that succeed take up to 80


def arm_configuration(
    model: RobotModel, q: FloatArray, goal: Pose, tolerance: float = 1e-4
) -> tuple[FloatArray, float]:
    """Return the configuration near q whose arm has the tool at the goal, (n,), and the error that is left.

    Damped Gauss–Newton: `Δq = sat(Jᵀ (J Jᵀ + λ I)⁻¹ e)`, e = (p_goal − p, log(R_goal Rᵀ)), joints inside
    their limits. Out of reach it ends as near as it comes.

    Args:
        model: of the robot.
        q: to begin with, (n,).
        goal: of the tool.
        tolerance: largest entry of e that is good enough [m, rad].
    """
    return _configuration(model, q, goal, tolerance, slice(len(model.description.base.joints), model.size))


def body_configuration(
    model: RobotModel, q: FloatArray, goal: Pose, tolerance: float = 1e-4
) -> tuple[FloatArray, float]:
    """Return the same with a base that moves too: where it would stand, and the arm there, (n,)."""
    return _configuration(model, q, goal, tolerance, slice(0, model.size))


def _configuration(
    model: RobotModel, q: FloatArray, goal: Pose, tolerance: float, moving: slice
) -> tuple[FloatArray, float]:
    q, limits, damping = np.array(q, dtype=float), model.description.limits, _DAMPING * np.eye(6)
    lower, upper = limits.position_lower[moving], limits.position_upper[moving]
    error = pose_error(model.pose(q), goal)
    for _ in range(_STEPS):
        if np.abs(error).max() < tolerance:
            break
        jacobian = model.jacobian(q)[:, moving]
        step = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + damping, error)
        moved = q[moving] + np.minimum(np.maximum(step, -_LARGEST_STEP), _LARGEST_STEP)
        q[moving] = np.minimum(np.maximum(moved, lower), upper)
        error = pose_error(model.pose(q), goal)
    return q, float(np.abs(error).max())


def pose_error(tool: Pose, goal: Pose) -> FloatArray:
    """Return the twist that takes a pose to a goal in a second, world-aligned, (6,) [m, rad]."""
    turn = rotation_vector(goal.rotation @ tool.rotation.T)
    return np.concatenate([goal.position - tool.position, turn])

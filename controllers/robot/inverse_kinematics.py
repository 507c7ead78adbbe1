"""Inverse kinematics of the arm, the base standing still: which joints put the tool where it shall be."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.core.library import Memory, functions
from handrail.controllers.robot.model import Pose, RobotModel, joint_memory

_USUAL = 1e-4  # largest error that is good enough [m, rad]


def arm_configuration(
    model: RobotModel, q: FloatArray, goal: Pose, tolerance: float = _USUAL
) -> tuple[FloatArray, float]:
    """Return the configuration near q whose arm has the tool at the goal, (n,), and the error that is left.

    Damped Gauss–Newton: `Δq = sat(Jᵀ (J Jᵀ + λ I)⁻¹ e)`, e = (p_goal − p, log(R_goal Rᵀ)), joints inside
    their limits (core/kinematics.c). Out of reach it ends as near as it comes.

    Args:
        model: of the robot.
        q: to begin with, (n,).
        goal: of the tool.
        tolerance: largest entry of e that is good enough [m, rad].
    """
    return _configuration(model, q, goal, tolerance, len(model.description.base.joints))


def body_configuration(model: RobotModel, q: FloatArray, goal: Pose) -> tuple[FloatArray, float]:
    """Return the same with a base that moves too: where it would stand, and the arm there, (n,)."""
    return _configuration(model, q, goal, _USUAL, 0)


def hands_configuration(model: RobotModel, q: FloatArray, goals: Sequence[Pose]) -> tuple[FloatArray, float]:
    """Return the same with every hand at its own goal, by the joints that move it alone, (n,)."""
    q, description = np.array(q, dtype=np.float64), model.description
    shared = np.flatnonzero(np.sum(description.moves, axis=0) > 1)
    first = max(len(description.base.joints), 1 + int(np.max(shared, initial=-1)))
    errors = []
    for hand, goal in zip(description.hands, goals, strict=True):
        q, error = _configuration(model.with_hand(hand.name), q, goal, _USUAL, first)
        errors.append(error)
    return q, max(errors)


def _configuration(
    model: RobotModel, q: FloatArray, goal: Pose, tolerance: float, first: int
) -> tuple[FloatArray, float]:
    q = np.array(q, dtype=np.float64)
    rotation, position = (np.array(each, dtype=np.float64) for each in (goal.rotation, goal.position))
    error = functions().bring_tool(_tool(model), rotation, position, first, tolerance, q)
    return q, error


@lru_cache(maxsize=8)
def _tool(model: RobotModel) -> Memory:
    """Return the compiled core's scene with nothing but the tool in it."""
    memory, frame = joint_memory(model, 1, 0), model.pinocchio.frames[model.frame_id("")]
    memory.carrier[0] = frame.parentJoint
    memory.shape_rotation[:], memory.shape_position[:] = (
        frame.placement.rotation.ravel(),
        frame.placement.translation,
    )
    return memory

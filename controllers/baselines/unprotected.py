"""Controllers that protect nothing: what is asked for by damped least squares, clipped to limits."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.arm_completion import ArmCompletion
from handrail.controllers.baselines.reactive import ReactiveController
from handrail.controllers.baselines.twist_completion import base_velocity, damped_least_squares, tool_twist
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.usual_frames import commanded_rows
from handrail.controllers.robot.model import RobotModel

_DAMPING = 0.01  # λ, as in WholeBodyCompletion


def unprotected_controller(model: RobotModel, period: float = 0.05) -> ReactiveController:
    """Return the controller for any mask that looks neither ahead nor at obstacles.

    `v = argmin ‖M (C v − u)‖² + λ ‖W v‖²`, C the channels' matrix, M the mask, `W = diag(1 / v_max)`: what a
    partial command comes to where nothing but the joints' limits is kept.

    Args:
        model: of the robot.
        period: of the control loop [s].
    """
    inverse = model.description.limits.velocity**2 / _DAMPING  # of λ W², (n,)

    def ask(state: State, intent: Intent, previous: FloatArray) -> FloatArray:
        return damped_least_squares(*commanded_rows(intent, model, state.q), inverse)

    return ReactiveController(model, ask, period)


def split_controller(model: RobotModel, period: float = 0.05) -> ReactiveController:
    """Return the controller that sends the base where its stick says, and the hand by the arm's joints alone.

    v_base as commanded; `q̇_arm = (JᵀJ + λW²)⁻¹ Jᵀ (twist − J_b v_base)` while the hand is, else 0.
    It looks neither ahead nor at obstacles; single joints make it brake.

    Args:
        model: of the robot.
        period: of the control loop [s].
    """
    channels, arm = Channels.of(model.description), ArmCompletion(model)
    understood = channels.mask(*(("base",) if channels.base else ()), model.hand.name or "ee")

    def ask(state: State, intent: Intent, previous: FloatArray) -> FloatArray:
        base = base_velocity(intent, channels, state.q)
        if not intent.mask[channels.hand_slice(model.number)].any():
            return np.concatenate([base, np.zeros(model.size - len(base))])
        twist = tool_twist(intent, channels, model.pose(state.q), model.number)
        return arm.velocity(state.q, previous, base, twist, period)

    return ReactiveController(model, ask, period, understood=understood)

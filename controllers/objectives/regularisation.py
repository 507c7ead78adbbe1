"""Keep slow, smooth and comfortable what nobody commands."""

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.objectives.objective import Objective
from handrail.controllers.objectives.ownership import commanded_joints


def velocity_regularisation(channels: Channels, weights: FloatArray) -> Objective:
    """Keep slow what nobody commands: `‖v‖²` on the joints without a command of their own, weights (n,)."""
    return Objective(
        name="velocity",
        residual=lambda stage, p: stage.v,
        reference=np.zeros(len(weights)),
        weights=lambda mask: weights * ~commanded_joints(channels, mask),
    )


def acceleration_regularisation(weights: FloatArray) -> Objective:
    """Keep the motion smooth: `‖u‖²` on every joint, weights (n,)."""
    return Objective(
        name="acceleration",
        residual=lambda stage, p: stage.u,
        reference=np.zeros(len(weights)),
        weights=lambda mask: weights,
    )


def posture(channels: Channels, reference: FloatArray, weights: FloatArray) -> Objective:
    """Draw the joints that nobody commands to a posture while the tool is steered, `‖q - q_ref‖²`, (n,)."""

    def masked(mask: BoolArray) -> FloatArray:
        steered = bool(np.any(mask[channels.tool_slice]))
        return weights * ~commanded_joints(channels, mask) * steered

    return Objective("posture", lambda stage, p: stage.q, np.array(reference), masked)

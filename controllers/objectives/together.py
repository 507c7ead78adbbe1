"""Keep two hands as they are to each other while they are steered as a pair."""

import casadi as ca
import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.objectives.hold import bounded_pull, hold_parameters, turn_between
from handrail.controllers.objectives.objective import Objective, Stage
from handrail.controllers.robot.model import Pose, RobotModel

TOGETHER = "together"


def together(channels: Channels, position: float = 200.0, orientation: float = 50.0) -> Objective:
    """Keep the first hand where it is in the axes of the second: `‖p − p*‖²` and `‖2 sin(θ/2) a‖²`.

    `p = R₂ᵀ (p₁ − p₂)`, and (a, θ) the turn from R* to `R₂ᵀ R₁`; bounded as in `end_effector_hold`. It rests
    unless the operator steers the pair, and all of it where they steer a hand by itself; how far the hands
    are apart is left to them where they own that.

    Args:
        channels: of a robot with two hands.
        position: weight of the place [1/m²].
        orientation: weight of the turn [1/rad²].
    """

    def residual(stage: Stage, p: ca.SX) -> ca.SX:
        one, other = stage.tool(0), stage.tool(1)
        place = other.rotation.T @ (one.position - other.position)
        turn = turn_between(ca.reshape(p[3:12], 3, 3).T, other.rotation.T @ one.rotation)
        return ca.vertcat(bounded_pull(place - p[:3]), bounded_pull(turn))

    def weights(mask: BoolArray) -> FloatArray:
        *pair, apart = mask[channels.pair_slice]
        alone = any(mask[channels.hand_slice(hand)].any() for hand in range(2))
        kept = any(pair) and not alone
        return np.repeat([position * (kept and not apart), orientation * kept], 3)

    rest = hold_parameters(Pose(np.zeros(3), np.eye(3)))
    return Objective(TOGETHER, residual, np.zeros(6), weights, rest)


def together_parameters(model: RobotModel, q: FloatArray) -> FloatArray:
    """Return the parameters that keep the hands as they are at q, (12,)."""
    one, other = (model.pose(q, hand.named("tool")) for hand in model.description.hands)
    turn = other.rotation.T
    return hold_parameters(Pose(turn @ (one.position - other.position), turn @ one.rotation))

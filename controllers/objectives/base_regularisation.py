"""Keep the base still, or near a pose."""

import casadi as ca
import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.objectives.objective import Objective, Stage
from handrail.controllers.objectives.ownership import commanded_joints, leaves_freedom
from handrail.controllers.objectives.smooth import bounded_pull


def base_regularisation(
    channels: Channels,
    still: float = 0.3,
    near: float = 0.0,
    reach: float = 0.1,
    name: str = "base",
) -> Objective:
    """Keep the base still, `‖v_base‖²`, and near a pose, `‖(x, y, θ) - p‖²` with a bounded pull.

    Parameters: the pose (x, y, θ) [m, rad], (3,). Coordinates of the base that are commanded are left alone.

    Args:
        channels: of the robot.
        still: weight of the velocity.
        near: weight of the distance to the pose.
        reach: distance from which the pull grows no more [m].
        name: of the objective.

    Raises:
        HandrailError: the base of the robot is fixed.
    """
    if not channels.base:
        raise HandrailError(f"objective {name}: expected a robot with a mobile base, got a fixed one")

    def residual(stage: Stage, p: ca.SX) -> ca.SX:
        return ca.vertcat(stage.v[:3], bounded_pull(stage.q[:3] - p, reach))

    def weights(mask: BoolArray) -> FloatArray:
        free = ~commanded_joints(channels, mask)[:3] * leaves_freedom(channels, mask)
        return np.concatenate([still * free, near * free])

    return Objective(name, residual, np.zeros(6), weights, np.zeros(3))

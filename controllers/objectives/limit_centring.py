"""Keep joints away from their position limits."""

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.channels import Channels
from handrail.controllers.description import Limits
from handrail.controllers.objective import Objective
from handrail.controllers.objectives.ownership import commanded_joints, leaves_freedom


def limit_centring(
    channels: Channels, limits: Limits, weights: FloatArray, power: int = 3, name: str = "centring"
) -> Objective:
    """Centre joints between their limits: `((q - middle) / half)^power`, (n,).

    An odd power above 1 leaves the middle of the range alone and pushes near its ends. Joints that are
    commanded themselves are left alone.

    Args:
        channels: of the robot.
        limits: of the robot.
        weights: one a joint, (n,).
        power: 1 for plain centring; odd.
        name: of the objective.
    """
    middle = 0.5 * (limits.position_upper + limits.position_lower)
    half = 0.5 * (limits.position_upper - limits.position_lower)
    weights = np.array(weights, dtype=float)

    def masked(mask: BoolArray) -> FloatArray:
        return weights * ~commanded_joints(channels, mask) * leaves_freedom(channels, mask)

    return Objective(
        name, lambda stage, p: ((stage.q - middle) / half) ** power, np.zeros(len(middle)), masked
    )

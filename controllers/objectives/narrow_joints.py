"""Keep joints of the arm that cannot turn far away from their position limits."""

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.objectives.objective import Objective
from handrail.controllers.objectives.ownership import commanded_joints, leaves_freedom
from handrail.controllers.robot.description import Limits


def narrow_joint_centring(channels: Channels, limits: Limits, weight: float) -> tuple[Objective, ...]:
    """Draw joints of the arm that cannot turn half around to their middle while just the tool is steered.

    `(q - middle) / half`, (n,). A hand that is steered straight to where it shall be may otherwise lead them
    into a corner of their limits that only going back leads out of. Nothing for an arm whose joints all turn
    that far; nor where base or joints are steered too, or the hand's tilt is left to another objective: it
    would pull against these.

    Args:
        channels: of the robot.
        limits: of the robot.
        weight: of each such joint.
    """
    narrow = limits.position_upper - limits.position_lower < np.pi
    narrow[: len(channels.base)] = False
    if not narrow.any():
        return ()
    middle = 0.5 * (limits.position_upper + limits.position_lower)
    half = 0.5 * (limits.position_upper - limits.position_lower)

    def masked(mask: BoolArray) -> FloatArray:
        alone = bool(mask[channels.tool_slice].all()) and not commanded_joints(channels, mask).any()
        return weight * narrow * (alone and leaves_freedom(channels, mask))

    return (Objective("centring", lambda stage, p: (stage.q - middle) / half, np.zeros(len(middle)), masked),)

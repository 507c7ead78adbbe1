"""What a mask leaves to the robot: objectives rest where the operator owns what they act through."""

import numpy as np

from handrail.controllers.arrays import BoolArray
from handrail.controllers.interface.channels import Channels


def commanded_joints(channels: Channels, mask: BoolArray) -> BoolArray:
    """Return which joints have a command of their own, through a joint or a base channel, (n,)."""
    joints = mask[channels.joint_slice].copy()
    if channels.base:
        joints[:2] |= mask[:2].any()
        joints[2] |= mask[2]
    return joints


def leaves_freedom(channels: Channels, mask: BoolArray) -> bool:
    """Whether fewer velocities are commanded than the robot has joints."""
    commanded = np.count_nonzero(commanded_joints(channels, mask)) + np.count_nonzero(
        mask[channels.tool_slice]
    )
    return bool(commanded < len(channels.joints))


def leaves_hand(channels: Channels, mask: BoolArray) -> bool:
    """Whether the hand's pose is not fully commanded: not all of its twist, nor all joints."""
    return leaves_freedom(channels, mask) and not bool(mask[channels.tool_slice].all())

"""The freedom that a mask leaves: objectives rest where the operator owns what they act through."""

import numpy as np

from handrail.controllers.arrays import BoolArray
from handrail.controllers.interface.channels import Channels


def commanded_joints(channels: Channels, mask: BoolArray) -> BoolArray:
    """Return which joints have a command of their own, through a joint or a base channel, (n,).

    vx or vy of the base alone fixes neither of its joints: these are along the world's axes.
    """
    joints = mask[channels.joint_slice].copy()
    if channels.base:
        joints[:2] |= mask[:2].all()
        joints[2] |= mask[2]
    return joints


def leaves_freedom(channels: Channels, mask: BoolArray) -> bool:
    """Whether fewer velocities are commanded than there are joints that move a hand.

    Each row of a twist takes a joint that nobody commands: of the hand's own arm first, then of those that
    move another hand too. vx or vy of the base alone takes one of its joints.
    """
    hands, commanded = range(len(channels.hands)), commanded_joints(channels, mask)
    commanded[:1] |= mask[channels.base_slice][:2].any()
    left = [channels.moving(hand) & ~commanded for hand in hands]
    count = np.sum(left, axis=0)
    own = [np.count_nonzero(each & (count == 1)) for each in left]
    rows = [np.count_nonzero(mask[channels.hand_slice(hand)]) for hand in hands]
    beyond = sum(max(each - arm, 0) for each, arm in zip(rows, own, strict=True))
    taken = sum(map(min, rows, own)) + min(beyond, np.count_nonzero(count > 1))
    return bool(taken + np.count_nonzero(mask[channels.pair_slice]) < np.count_nonzero(count))


def steered_joints(channels: Channels, mask: BoolArray) -> BoolArray:
    """Return which joints have a command of their own, or move a hand of which an axis is commanded, (n,)."""
    found = commanded_joints(channels, mask)
    for hand in range(len(channels.hands)):
        if channels.twist_mask(mask, hand).any() or mask[channels.pair_slice].any():
            found |= channels.moving(hand)
    return found

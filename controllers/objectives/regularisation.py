"""Keep slow, smooth and comfortable what nobody commands."""

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.objectives.objective import Objective
from handrail.controllers.objectives.ownership import commanded_joints, leaves_freedom
from handrail.controllers.robot.parts import Limits


def velocity_regularisation(channels: Channels, weights: FloatArray) -> Objective:
    """Keep slow what nobody commands: `‖v‖²` on the joints without a command of their own, weights (n,)."""

    def masked(mask: BoolArray) -> FloatArray:
        return weights * ~commanded_joints(channels, mask)

    return Objective("velocity", lambda stage, p: stage.v, np.zeros(len(weights)), masked)


def acceleration_regularisation(weights: FloatArray) -> Objective:
    """Keep the motion smooth: `‖u‖²` on every joint, weights (n,)."""
    return Objective("acceleration", lambda stage, p: stage.u, np.zeros(len(weights)), lambda mask: weights)


def posture(channels: Channels, reference: FloatArray, weights: FloatArray) -> Objective:
    """Draw the joints that nobody commands to a posture while a hand is steered, `‖q - q_ref‖²`, (n,)."""

    def masked(mask: BoolArray) -> FloatArray:
        steered = bool(np.any(mask[channels.hands_slice]))
        return weights * ~commanded_joints(channels, mask) * steered

    return Objective("posture", lambda stage, p: stage.q, np.array(reference), masked)


def narrow_joint_centring(channels: Channels, limits: Limits, weight: float = 10.0) -> tuple[Objective, ...]:
    """Draw joints of the arm that cannot turn half around to their middle while just the tool is steered.

    `(q - middle) / half`, (n,). A hand that is steered straight to where it shall be may otherwise lead them
    into a corner of their limits that only going back leads out of. Nothing for an arm whose joints all turn
    that far, nor for joints that carry several hands: they would take the arms along that nobody steers. It
    rests where base or joints are steered too, or the hand's tilt is left to another objective: it would pull
    against these.

    Args:
        channels: of the robot.
        limits: of the robot.
        weight: of each such joint.
    """
    narrow = limits.position_upper - limits.position_lower < np.pi
    narrow &= np.sum([channels.moving(hand) for hand in range(len(channels.hands))], axis=0) < 2
    narrow[: len(channels.base)] = False
    if not narrow.any():
        return ()
    middle = 0.5 * (limits.position_upper + limits.position_lower)
    half = 0.5 * (limits.position_upper - limits.position_lower)

    def masked(mask: BoolArray) -> FloatArray:
        steered = np.zeros(len(narrow), dtype=bool)
        for hand in range(len(channels.hands)):
            if channels.twist_mask(mask, hand).all():
                steered |= channels.moving(hand)
        others = mask[channels.base_slice].any() or mask[channels.joint_slice].any()
        alone = not others and leaves_freedom(channels, mask)
        return weight * narrow * (steered & alone)

    return (Objective("centring", lambda stage, p: (stage.q - middle) / half, np.zeros(len(middle)), masked),)

"""Hold a frame of the robot at a pose, or at a point."""

import casadi as ca
import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.objectives.objective import Objective, Stage
from handrail.controllers.objectives.ownership import leaves_freedom
from handrail.controllers.robot.model import Pose

_TINY = 1e-9
_REACH = 0.05  # distance [m] and angle [rad] from which the pull grows no more


def end_effector_hold(
    channels: Channels, position: float = 5.0, orientation: float = 0.0, hand: int = 0
) -> Objective:
    """Hold a hand at a pose: `‖p - p*‖²` and `‖2 sin(θ/2) a‖²` of the turn (a, θ) from R* to R.

    Far from the pose the pull is bounded. Parameters: `hold_parameters(pose)`. The rows of
    the position rest while the operator owns a linear channel of the hand, those of the orientation while
    an angular one is owned.

    Args:
        channels: of the robot.
        position: weight of the position [1/m²].
        orientation: weight of the orientation [1/rad²]; 0 holds the point only.
        hand: which of the hands.
    """
    name = channels.hands[hand][0].split(".")[0]

    def residual(stage: Stage, p: ca.SX) -> ca.SX:
        pose = stage.tool(hand)
        parts = [bounded_pull(pose.position - p[:3])]
        if orientation:
            parts.append(bounded_pull(turn_between(ca.reshape(p[3:12], 3, 3).T, pose.rotation)))
        return ca.vertcat(*parts)

    def weights(mask: BoolArray) -> FloatArray:
        tool, free = channels.twist_mask(mask, hand), leaves_freedom(channels, mask)
        parts = [np.full(3, position * (free and not tool[:3].any()))]
        if orientation:
            parts.append(np.full(3, orientation * (free and not tool[3:].any())))
        return np.concatenate(parts)

    return Objective(
        name="hold" if len(channels.hands) == 1 else f"{name}.hold",
        residual=residual,
        reference=np.zeros(6 if orientation else 3),
        weights=weights,
        parameters=hold_parameters(Pose(np.zeros(3), np.eye(3))),
    )


def hold_parameters(pose: Pose) -> FloatArray:
    """Return the parameters of a hold: position [m] and rotation, row by row, (12,)."""
    return np.concatenate([pose.position, np.asarray(pose.rotation).ravel()])


def turn_between(goal: ca.SX, rotation: ca.SX) -> ca.SX:
    """Return `2 sin(θ/2) a` of the turn `R R*ᵀ`, (3, 1): twice the vector part of its quaternion."""
    turn = rotation @ goal.T
    twice = ca.vertcat(turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1])
    return twice / ca.sqrt(1.0 + ca.trace(turn) + _TINY)


def bounded_pull(error: ca.SX) -> ca.SX:
    """Return e scaled to `‖r‖² = 2 δ² (√(1 + ‖e‖²/δ²) - 1)`, the pseudo-Huber loss, δ = reach.

    Near the goal r = e; far from it the cost grows linearly, so that its pull, at most weight times δ,
    cannot outweigh the tracking of a command.
    """
    root = ca.sqrt(1.0 + ca.dot(error, error) / _REACH**2)
    return error * ca.sqrt(2.0 / (root + 1.0))

"""Track the intent on the commanded channels."""

import casadi as ca
import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.frames import Frames
from handrail.controllers.objectives.objective import Objective, Stage

_TINY = 1e-9  # [m²]


def tracking(channels: Channels, weights: FloatArray) -> Objective:
    """Track the intent: `‖M (c(q, v) - c_ref)‖²` (the paper's equation 6a).

    The parameters are those of `Frames`: in which frames the twists are meant, and the tool point.

    Args:
        channels: of the robot.
        weights: one a channel, (m,).
    """
    return Objective(
        name="tracking",
        residual=lambda stage, p: channel_velocities(stage, channels, p),
        reference=np.zeros(channels.size),
        weights=lambda mask: weights * mask,
        parameters=Frames().parameters,
    )


def channel_velocities(stage: Stage, channels: Channels, p: ca.SX) -> ca.SX:
    """Return the realised velocity on every channel, (m, 1): of base, hands, their pair, joints.

    With p = (world, tool, x, y, z): the base twist is `Rᵀ v` in the base frame, or v if `world` is 1; the
    twist of a tool point `p_tool + R (x, y, z)` is world-aligned, or `Rᵀ (v, ω)` if `tool` is 1.
    """
    twists = [_tool_twist(stage, hand, p[1], p[2:5]) for hand in range(len(channels.hands))]
    hands = [part for twist in twists for part in twist]
    pair = _pair_twist(stage, p[1]) if channels.pair else []
    return ca.vertcat(*_base_twist(stage, channels, p[0]), *hands, *pair, stage.v)


def _base_twist(stage: Stage, channels: Channels, world: ca.SX) -> list[ca.SX]:
    if not channels.base:
        return []
    angle = (1 - world) * stage.q[2]
    c, s = ca.cos(angle), ca.sin(angle)
    vx, vy, wz = stage.v[0], stage.v[1], stage.v[2]
    return [c * vx + s * vy, -s * vx + c * vy, wz]


def _pair_twist(stage: Stage, tool: ca.SX) -> list[ca.SX]:
    """Return the mean twist of two hands, in the axes of the first if `tool` is 1, and how fast they part."""
    one, other = stage.tool(0), stage.tool(1)
    mean = 0.5 * (one.jacobian + other.jacobian) @ stage.v
    turn = (1 - tool) * ca.SX.eye(3) + tool * one.rotation.T
    way = other.position - one.position
    parting = (other.jacobian[:3, :] - one.jacobian[:3, :]) @ stage.v
    apart = ca.dot(way, parting) / ca.sqrt(ca.dot(way, way) + _TINY)
    return [turn @ mean[:3], turn @ mean[3:], apart]


def _tool_twist(stage: Stage, hand: int, tool: ca.SX, offset: ca.SX) -> list[ca.SX]:
    pose = stage.tool(hand)
    twist = pose.jacobian @ stage.v
    linear = twist[:3] + ca.cross(twist[3:], pose.rotation @ offset)
    turn = (1 - tool) * ca.SX.eye(3) + tool * pose.rotation.T
    return [turn @ linear, turn @ twist[3:]]

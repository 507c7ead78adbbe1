"""Track the intent on the commanded channels."""

import casadi as ca
import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.frames import Frames
from handrail.controllers.objectives.objective import Objective, Stage


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
    """Return the realised velocity on every channel, (m, 1): base twist, tool twist, joint velocities.

    With p = (world, tool, x, y, z): the base twist is `Rᵀ v` in the base frame, or v if `world` is 1; the
    twist of the tool point `p_tool + R (x, y, z)` is world-aligned, or `Rᵀ (v, ω)` if `tool` is 1.
    """
    return ca.vertcat(*_base_twist(stage, channels, p[0]), *_tool_twist(stage, p[1], p[2:5]), stage.v)


def _base_twist(stage: Stage, channels: Channels, world: ca.SX) -> list[ca.SX]:
    if not channels.base:
        return []
    angle = (1 - world) * stage.q[2]
    c, s = ca.cos(angle), ca.sin(angle)
    vx, vy, wz = stage.v[0], stage.v[1], stage.v[2]
    return [c * vx + s * vy, -s * vx + c * vy, wz]


def _tool_twist(stage: Stage, tool: ca.SX, offset: ca.SX) -> list[ca.SX]:
    pose = stage.pose()
    twist = pose.jacobian @ stage.v
    linear = twist[:3] + ca.cross(twist[3:], pose.rotation @ offset)
    turn = (1 - tool) * ca.SX.eye(3) + tool * pose.rotation.T
    return [turn @ linear, turn @ twist[3:]]

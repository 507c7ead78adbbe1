"""Carry a tray: upright, and never faster round a corner than friction allows."""

import casadi as ca
import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.objectives.objective import Objective, Stage
from handrail.controllers.objectives.ownership import leaves_freedom

GRAVITY = 9.81  # [m/s²]
_WIDTH = 0.05  # of the smooth length [m/s²]
_SHARPNESS = 0.1  # width of the smooth hinge
_INSIDE = 0.3  # share of the tangential force that counts inside the cone


def tray_levelling(
    channels: Channels,
    up: FloatArray,
    level: float = 2.0,
    slip: float = 0.5,
    friction: float = 0.2,
    hands: tuple[int, ...] = (0,),
) -> Objective:
    """Keep a tray level and what stands on it in place.

    With the tray's normal `n = R up`: `‖n - e_z‖²`. With the specific force `f = a + g e_z`, where
    `a = J u + J̇ v`, its tangential part `t = f - (f·n) n`, and the smooth hinge h:
    `‖(c + h(1 - μ f·n / ‖t‖)) t‖²`, which is how far the force is outside the friction cone, and a share c
    of what is inside: a step from rest has to know the cone before it is left.

    Args:
        channels: of the robot.
        up: the tray's normal in the tool frame, a unit vector, (3,).
        level: weight of the tilt [1/rad²].
        slip: weight of the tangential acceleration beyond the cone [s⁴/m²].
        friction: μ.
        hands: that carry it; of several, their mean.
    """
    axis = np.array(up, dtype=float) / np.linalg.norm(up)

    def residual(stage: Stage, p: ca.SX) -> ca.SX:
        share = 1.0 / len(hands)
        normal = share * sum(stage.tool(hand).rotation @ axis for hand in hands)
        force = share * sum(acceleration(stage, hand) for hand in hands) + ca.DM([0.0, 0.0, GRAVITY])
        pressing = ca.dot(force, normal)
        sliding = force - pressing * normal
        beyond = _hinge(1.0 - friction * pressing / _norm(sliding, _WIDTH), _SHARPNESS)
        return ca.vertcat(normal - ca.DM([0.0, 0.0, 1.0]), (_INSIDE + beyond) * sliding)

    def weights(mask: BoolArray) -> FloatArray:
        tool, free = channels.twist_mask(mask, hands[0]), leaves_freedom(channels, mask)
        tilts, slips = free and not tool[3:5].any(), free and not tool[:3].all()
        return np.repeat([level * tilts, slip * slips], 3)

    return Objective("tray", residual, np.zeros(6), weights)


def acceleration(stage: Stage, hand: int = 0) -> ca.SX:
    """Return the linear acceleration of a hand's tool point, `J u + J̇ v`, (3, 1) [m/s²]."""
    linear = stage.tool(hand).jacobian[:3, :]
    return linear @ stage.u + ca.jtimes(linear @ stage.v, stage.q, stage.v)


def _hinge(x: ca.SX, width: float) -> ca.SX:
    """Return a smooth `max(x, 0)`: `½ (x + √(x² + width²)) `, off by at most width / 2, at x = 0."""
    return 0.5 * (x + ca.sqrt(x * x + width * width))


def _norm(vector: ca.SX, width: float) -> ca.SX:
    """Return a smooth length `√(‖vector‖² + width²)`."""
    return ca.sqrt(ca.dot(vector, vector) + width * width)

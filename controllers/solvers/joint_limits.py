"""The limits of the joints as rows of an update's QP: of their positions, velocities and accelerations."""

from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.slacks import LIMITS, SLACKS, VELOCITY_SLACK
from handrail.controllers.numerics.jit import jit
from handrail.controllers.solvers.active_rows import contains
from handrail.controllers.solvers.basis import REACH

_SHARES = (1.0, VELOCITY_SLACK, 0.0)  # a: accelerations get none of the slack
_TOLERANCES = (1e-5, 1e-5, 1e-7)  # of x


class JointLimits(NamedTuple):
    """`±x ≤ 1 + a σ` for every joint after every stage, x relative to half of its range.

    Attributes:
        value: x of the guess's (q, v, u), (N, 3, n).
        scale: half of the range, (3, n).
        broken: whether the guess breaks a limit of positions or velocities.
    """

    value: FloatArray
    scale: FloatArray
    broken: bool


@jit
def around(q, v, u, lower, upper, velocity, acceleration):
    """Return the limits around a guess: q and v at the nodes, (N + 1, n), and u, (N, n)."""
    horizon, n = u.shape
    value, scale, broken = np.empty((horizon, 3, n)), np.empty((3, n)), False
    for j in range(n):
        middle = 0.5 * (upper[j] + lower[j])
        scale[0, j], scale[1, j], scale[2, j] = 0.5 * (upper[j] - lower[j]), velocity[j], acceleration[j]
        for k in range(horizon):
            value[k, 0, j] = (q[k + 1, j] - middle) / scale[0, j]
            value[k, 1, j] = v[k + 1, j] / scale[1, j]
            value[k, 2, j] = u[k, j] / scale[2, j]
            broken |= max(abs(value[k, 0, j]), abs(value[k, 1, j])) > 1.0
    return JointLimits(value, scale, broken)


@jit
def most_violated(limits, motion, slack, active, worst, row):
    """Return violation and number of the row that is broken most, if more than the worst so far."""
    horizon, _, n = motion.shape
    for k in range(horizon):
        for part in range(3):
            allowed, tolerance = 1.0 + slack[LIMITS] * _SHARES[part], _TOLERANCES[part]
            for j in range(n):
                value = limits.value[k, part, j] + motion[k, part, j] / limits.scale[part, j]
                excess = abs(value) - allowed
                if excess > max(worst, tolerance):
                    number = SLACKS + 2 * ((k * 3 + part) * n + j) + (value < 0.0)
                    if not contains(active, number):
                        worst, row = excess, number
    return worst, row


@jit
def write_row(limits, matrix, row, out):
    """Write a row's coefficients of s and σ into zeros; return its right-hand side and first entry."""
    horizon, _, n = limits.value.shape
    index, sign = (row - SLACKS) // 2, 1.0 - 2.0 * ((row - SLACKS) % 2)
    k, part, j = index // (3 * n), index // n % 3, index % n
    first = k * n + j
    for a in range(REACH):
        column = (k + 1 - REACH + a) * n + j
        if column >= 0 and matrix[part, a] != 0.0:
            out[column] = sign / limits.scale[part, j] * matrix[part, a]
            first = min(first, column)
    out[horizon * n + LIMITS] = -_SHARES[part]
    return 1.0 - sign * limits.value[k, part, j], first

"""The active rows of the dual method, as `M = T Q`: T lower triangular, the rows of Q orthonormal.

Rows of neighbouring nodes are nearly parallel; products `M Mᵀ` would square that, so that Q is kept.
"""

from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.slacks import SLACKS
from handrail.controllers.numerics.jit import copy, jit

_CANCELLED = 0.25  # share of a row's square below which rounding makes a second projection worth while


class ActiveRows(NamedTuple):
    """Room for as many rows as there are variables; kept from update to update.

    Attributes:
        directions: Q, (A, N n + 4).
        triangle: T, (A, A).
        multipliers: λ, (A,).
        rows: their numbers, (A,).
        upper: their right-hand sides as seen from the free minimum, (A,).
    """

    directions: FloatArray
    triangle: FloatArray
    multipliers: FloatArray
    rows: IntArray
    upper: FloatArray


def active_rows(horizon: int, size: int) -> ActiveRows:
    """Return room for a problem of N stages and n coordinates."""
    count = horizon * size + SLACKS
    return ActiveRows(
        directions=np.zeros((count, count)),
        triangle=np.zeros((count, count)),
        multipliers=np.zeros(count),
        rows=np.zeros(count, dtype=np.int64),
        upper=np.zeros(count),
    )


@jit
def contains(rows, row):
    """Whether a row is among some."""
    found = False
    for index in range(len(rows)):
        found |= rows[index] == row
    return found


@jit
def project(held, count, new, along, shares, normal):
    """Split a row m into a combination of the active ones and what is normal to them; return its square.

    Args:
        held: the active rows.
        count: of them.
        new: m, (N n + 4,).
        along: filled with Q m, (A,).
        shares: filled with the combination, `T⁻ᵀ Q m`, (A,).
        normal: filled with the rest, `m - Qᵀ Q m`, (N n + 4,).
    """
    copy(new, len(new), normal)
    for i in range(count):
        along[i] = 0.0
    before = np.dot(new, new)
    while True:
        for i in range(count):
            share = np.dot(held.directions[i], normal)
            along[i] += share
            for t in range(len(normal)):
                normal[t] -= share * held.directions[i, t]
        square = np.dot(normal, normal)
        if square > _CANCELLED * before or square < 1e-30 * np.dot(new, new):
            break
        before = square
    copy(along, count, shares)
    upper_solve(held, count, shares)
    return square


@jit
def append(held, count, along, normal, square, row, upper, multiplier):
    """Make a row active that `project` has split; return how many are."""
    length = square**0.5
    for t in range(len(normal)):
        held.directions[count, t] = normal[t] / length
    copy(along, count, held.triangle[count])
    held.triangle[count, count] = length
    held.rows[count] = row
    held.upper[count] = upper
    held.multipliers[count] = multiplier
    return count + 1


@jit
def drop(held, count, index):
    """Make a row inactive; return how many are left. Rotations make T triangular again."""
    T, Q = held.triangle, held.directions
    for i in range(index, count - 1):
        held.rows[i] = held.rows[i + 1]
        held.upper[i] = held.upper[i + 1]
        held.multipliers[i] = held.multipliers[i + 1]
        copy(T[i + 1], i + 2, T[i])
    for i in range(index, count - 1):
        length = (T[i, i] ** 2 + T[i, i + 1] ** 2) ** 0.5
        c, s = T[i, i] / length, T[i, i + 1] / length
        T[i, i] = length
        for below in range(i + 1, count - 1):
            left, right = T[below, i], T[below, i + 1]
            T[below, i] = c * left + s * right
            T[below, i + 1] = c * right - s * left
        for t in range(Q.shape[1]):
            first, second = Q[i, t], Q[i + 1, t]
            Q[i, t] = c * first + s * second
            Q[i + 1, t] = c * second - s * first
    return count - 1


@jit
def settle(held, count, free, shares, y):
    """Write the nearest point to `-free` at which all active rows hold, and their multipliers.

    `y = -f + Qᵀ w` with `T w = b + M f`, and `λ = -T⁻ᵀ w`.
    """
    for i in range(count):
        total = held.upper[i]
        for t in range(i):
            total -= held.triangle[i, t] * shares[t]
        shares[i] = total / held.triangle[i, i]
    for t in range(len(y)):
        y[t] = -free[t]
    for i in range(count):
        held.multipliers[i] = -shares[i]
        for t in range(len(y)):
            y[t] += shares[i] * held.directions[i, t]
    upper_solve(held, count, held.multipliers)


@jit
def upper_solve(held, count, x):
    """Replace x by `T⁻ᵀ x`, (A,)."""
    for i in range(count - 1, -1, -1):
        value = x[i] / held.triangle[i, i]
        x[i] = value
        for t in range(i):
            x[t] -= held.triangle[i, t] * value

"""The active rows of the dual method and the Cholesky factor of their products, `M Mᵀ = T Tᵀ`."""

from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.constraints import SLACKS
from handrail.controllers.jit import jit


class ActiveRows(NamedTuple):
    """Room for as many rows as there are variables; kept from update to update.

    Attributes:
        rows: M, transformed rows, (A, N n + 2).
        triangle: T, lower, (A, A).
        multipliers: λ, (A,).
        keys: which rows they are, (A,).
        upper: their right-hand sides, (A,).
    """

    rows: FloatArray
    triangle: FloatArray
    multipliers: FloatArray
    keys: IntArray
    upper: FloatArray


def active_rows(horizon: int, size: int) -> ActiveRows:
    """Return room for a problem of N stages and n coordinates."""
    count = horizon * size + SLACKS
    return ActiveRows(
        rows=np.zeros((count, count)),
        triangle=np.zeros((count, count)),
        multipliers=np.zeros(count),
        keys=np.zeros(count, dtype=np.int64),
        upper=np.zeros(count),
    )


@jit
def project(held, count, new, shares, normal):  # noqa: ANN001, ANN201
    """Split a row into a combination of the active ones and what is normal to them; return its square.

    Args:
        held: the active rows.
        count: of them.
        new: the row m, (N n + 2,).
        shares: filled with `T⁻¹ M m` and, in its second row, `(M Mᵀ)⁻¹ M m`, (2, A).
        normal: filled with the rest, (N n + 2,).
    """
    size = len(new)
    for i in range(count):
        total = 0.0
        for t in range(size):
            total += held.rows[i, t] * new[t]
        shares[0, i] = total
    lower_solve(held, count, shares[0])
    shares[1, :count] = shares[0, :count]
    upper_solve(held, count, shares[1])
    normal[:] = new
    for i in range(count):
        for t in range(size):
            normal[t] -= shares[1, i] * held.rows[i, t]
    square = 0.0
    for t in range(size):
        square += normal[t] * normal[t]
    return square


@jit
def append(held, count, new, shares, square, key, upper, multiplier):  # noqa: ANN001, ANN201
    """Make a row active that `project` has split; return how many are."""
    held.rows[count] = new
    held.triangle[count, :count] = shares[0, :count]
    held.triangle[count, count] = square**0.5
    held.keys[count] = key
    held.upper[count] = upper
    held.multipliers[count] = multiplier
    return count + 1


@jit
def drop(held, count, index):  # noqa: ANN001, ANN201
    """Make a row inactive; return how many are left. Rotations make the factor triangular again."""
    for i in range(index, count - 1):
        held.rows[i] = held.rows[i + 1]
        held.keys[i] = held.keys[i + 1]
        held.upper[i] = held.upper[i + 1]
        held.multipliers[i] = held.multipliers[i + 1]
        held.triangle[i, : i + 2] = held.triangle[i + 1, : i + 2]
    T = held.triangle
    for i in range(index, count - 1):
        length = (T[i, i] ** 2 + T[i, i + 1] ** 2) ** 0.5
        c, s = T[i, i] / length, T[i, i + 1] / length
        T[i, i] = length
        for row in range(i + 1, count - 1):
            left, right = T[row, i], T[row, i + 1]
            T[row, i] = c * left + s * right
            T[row, i + 1] = c * right - s * left
    return count - 1


@jit
def lower_solve(held, count, x):  # noqa: ANN001, ANN201
    """Replace x by `T⁻¹ x`, (A,)."""
    for i in range(count):
        total = x[i]
        for t in range(i):
            total -= held.triangle[i, t] * x[t]
        x[i] = total / held.triangle[i, i]


@jit
def upper_solve(held, count, x):  # noqa: ANN001, ANN201
    """Replace x by `T⁻ᵀ x`, (A,)."""
    for i in range(count - 1, -1, -1):
        value = x[i] / held.triangle[i, i]
        x[i] = value
        for t in range(i):
            x[t] -= held.triangle[i, t] * value

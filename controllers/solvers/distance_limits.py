"""The limits of the distances as rows of an update's QP: pairs that are near must not come too near."""

from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.numerics.jit import jit
from handrail.controllers.solvers.active_rows import contains
from handrail.controllers.solvers.basis import REACH, to_variables

RECOVERY = 0.8  # of a distance deficit that is left after each node
_NODES = 1000  # more than there are in any plan
_TOLERANCE = 1e-6  # [m]
_SCALE = 10.0  # a violation of 0.1 m counts like one of a whole joint limit


class DistanceLimits(NamedTuple):
    """`c s - σ ≤ b` for every pair that is near at a node, with the slack σ of the pair's kind.

    Attributes:
        stage: whose variables move the pair, (R,).
        kind: which is its slack, (R,).
        coefficients: c, of the stage's variables, (R, 3n).
        left: b, how much of the distance is left [m], (R,).
        row: numbers of the rows, which a pair keeps from update to update, (R,).
        first: below all of these numbers.
    """

    stage: IntArray
    kind: IntArray
    coefficients: FloatArray
    left: FloatArray
    row: IntArray
    first: int


@jit
def around(matrix, near, gradients, values, margins, kinds, gains, horizon, first):
    """Return the limits around a guess: `d ≥ margin - deficit 0.8ᵏ` at every node k after now.

    So a pair inside its margin recovers gradually. Arguments as in basis.py, `Distances`, `Problem`, `Nodes`.
    """
    n = gradients.shape[1]
    count = 0
    for entry in range(len(near)):
        count += near[entry, 0] > 0
    stage, kind = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    row = np.empty(count, dtype=np.int64)
    coefficients, left = np.empty((count, REACH * n)), np.empty(count)
    by_velocity, none = np.zeros(n), np.zeros(n)
    index = 0
    for entry in range(len(near)):
        node, pair = near[entry]
        if node == 0:
            continue
        for j in range(n):
            gain = gains[node - horizon - 1, j] if node > horizon else 0.0
            by_velocity[j] = -gain * gradients[entry, j]
        to_variables(matrix, -gradients[entry], by_velocity, none, coefficients[index])
        deficit = max(margins[pair] - values[0, pair], 0.0)
        left[index] = values[node, pair] - margins[pair] + deficit * RECOVERY**node
        stage[index], kind[index] = min(node, horizon) - 1, kinds[pair]
        row[index] = first + pair * _NODES + node
        index += 1
    return DistanceLimits(stage, kind, coefficients, left, row, first)


@jit
def most_violated(limits, s, slack, active, worst, row):
    """Return violation and number of the row that is broken most, if more than the worst so far."""
    n = limits.coefficients.shape[1] // REACH
    for index in range(len(limits.left)):
        start = (limits.stage[index] + 1 - REACH) * n
        change = 0.0
        for column in range(max(0, -start), REACH * n):
            change += limits.coefficients[index, column] * s[start + column]
        excess = change - limits.left[index] - slack[limits.kind[index]]
        scaled = _SCALE * excess
        if excess > _TOLERANCE and scaled > worst and not contains(active, limits.row[index]):
            worst, row = scaled, limits.row[index]
    return worst, row


@jit
def write_row(limits, row, out, size):
    """Write a row's coefficients of s and σ into zeros; return its right-hand side and first entry."""
    index = 0
    while limits.row[index] != row:
        index += 1
    n = limits.coefficients.shape[1] // REACH
    start = (limits.stage[index] + 1 - REACH) * n
    first = max(0, start)
    for column in range(first - start, REACH * n):
        out[start + column] = limits.coefficients[index, column]
    out[size + limits.kind[index]] = -1.0
    return limits.left[index], first

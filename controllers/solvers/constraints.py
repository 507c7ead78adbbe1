"""The inequality rows of one update's QP, in variables of local support, and which of them a point breaks.

A row `c_pᵀ s - a_p σ ≤ b_p` has a number: first come the slacks (σ ≥ 0, slacks.py), then the limits of the
joints, then those of the distances. The same row has the same number in every update.
"""

from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.model import Distances
from handrail.controllers.collision.slacks import LIMITS, SLACKS, VELOCITY_SLACK
from handrail.controllers.numerics.jit import jit
from handrail.controllers.ocp.nodes import Nodes
from handrail.controllers.ocp.problem import Problem
from handrail.controllers.solvers.active_rows import contains
from handrail.controllers.solvers.basis import REACH, to_variables

RECOVERY = 0.8  # of a distance deficit that is left after each node
_NODES = 1000  # more than there are in any plan
_SLACK_TOLERANCE = 1e-7
_SHARES = (1.0, VELOCITY_SLACK, 0.0)  # a of the joints' limits: accelerations get none of the slack
_TOLERANCES = (1e-5, 1e-5, 1e-7)  # of x
_DISTANCE_TOLERANCE = 1e-6  # [m]
_SCALE = 10.0  # a violation of 0.1 m counts like one of a whole joint limit


class Constraints(NamedTuple):
    """All limits around a guess.

    Of the joints: `±x ≤ 1 + a σ` after every stage, x of (q, v, u) relative to half of its range. Of the
    distances: `c s - σ ≤ b` for every pair that is near at a node, with the slack σ of the pair's kind.

    Attributes:
        matrix: of basis.py, (3, 3).
        value: x of the guess, (N, 3, n).
        scale: half of the range, (3, n).
        stage: whose variables move the pair, (R,).
        kind: which is its slack, (R,).
        coefficients: c, of the stage's variables, (R, 3n).
        left: b, how much of the distance is left [m], (R,).
        row: numbers of the distances' rows, which a pair keeps from update to update, (R,).
        first: below all of these numbers.
        broken: whether the guess itself breaks a limit that is soft.
    """

    matrix: FloatArray
    value: FloatArray
    scale: FloatArray
    stage: IntArray
    kind: IntArray
    coefficients: FloatArray
    left: FloatArray
    row: IntArray
    first: int
    broken: bool


def constraints_around(
    problem: Problem, motion: tuple[FloatArray, ...], nodes: Nodes, found: Distances, matrix: FloatArray
) -> Constraints:
    """Return the constraints around a guess: q and v at the nodes, (N + 1, n), and u, (N, n).

    Args:
        problem: of the update.
        motion: the guess.
        nodes: of the guess.
        found: distances there.
        matrix: of basis.py.
    """
    limits, kinds = problem.limits, problem.collision.kinds
    bounds = limits.position_lower, limits.position_upper, limits.velocity, limits.acceleration
    pairs = found.near, found.gradients, found.values, problem.margins, kinds, nodes.gains
    return Constraints(*_around(matrix, motion, bounds, pairs))


@jit
def _around(matrix, motion, bounds, pairs):
    value, scale, broken = _joints(*motion, *bounds)
    first = SLACKS + 2 * value.size
    rows = _distances(matrix, *pairs, len(value), first)
    for left in rows[3]:
        broken |= left < 0.0
    return matrix, value, scale, *rows, first, broken


@jit
def _joints(q, v, u, lower, upper, velocity, acceleration):
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
    return value, scale, broken


@jit
def _distances(matrix, near, gradients, values, margins, kinds, gains, horizon, first):
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
    return stage, kind, coefficients, left, row


@jit
def most_violated(constraints, s, motion, slack, active):
    """Return the number of the row that a point breaks most, those already active left out; -1 if none.

    Args:
        constraints: of the update.
        s: the variables, (N n,).
        motion: changes of (q, v, u) after every stage, (N, 3, n).
        slack: σ, (4,).
        active: numbers of the active rows, (A,).
    """
    worst, row = 0.0, -1
    for index in range(SLACKS):
        if -slack[index] > max(worst, _SLACK_TOLERANCE) and not contains(active, index):
            worst, row = -slack[index], index
    worst, row = _worst_joint(constraints, motion, slack, active, worst, row)
    return _worst_distance(constraints, s, slack, active, worst, row)


@jit
def _worst_joint(limits, motion, slack, active, worst, row):
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
def _worst_distance(limits, s, slack, active, worst, row):
    """Return the number of the row that is broken most, if more than the worst so far."""
    n = limits.coefficients.shape[1] // REACH
    for index in range(len(limits.left)):
        start = (limits.stage[index] + 1 - REACH) * n
        change = 0.0
        for column in range(max(0, -start), REACH * n):
            change += limits.coefficients[index, column] * s[start + column]
        excess = change - limits.left[index] - slack[limits.kind[index]]
        scaled = _SCALE * excess
        if excess > _DISTANCE_TOLERANCE and scaled > worst and not contains(active, limits.row[index]):
            worst, row = scaled, limits.row[index]
    return row


@jit
def write_row(constraints, row, out):
    """Write a row's coefficients of s and σ, (N n + 4,); return its right-hand side and first entry.

    The slacks' entries are written as they stand in the row: -1 for σ ≥ 0, else -a.
    """
    size = len(out) - SLACKS
    for index in range(len(out)):
        out[index] = 0.0
    if row < SLACKS:
        out[size + row] = -1.0
        return 0.0, size
    if row < constraints.first:
        return _write_joint(constraints, row, out)
    return _write_distance(constraints, row, out, size)


@jit
def _write_joint(limits, row, out):
    horizon, _, n = limits.value.shape
    index, sign = (row - SLACKS) // 2, 1.0 - 2.0 * ((row - SLACKS) % 2)
    k, part, j = index // (3 * n), index // n % 3, index % n
    first = k * n + j
    for a in range(REACH):
        column = (k + 1 - REACH + a) * n + j
        if column >= 0 and limits.matrix[part, a] != 0.0:
            out[column] = sign / limits.scale[part, j] * limits.matrix[part, a]
            first = min(first, column)
    out[horizon * n + LIMITS] = -_SHARES[part]
    return 1.0 - sign * limits.value[k, part, j], first


@jit
def _write_distance(limits, row, out, size):
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


@jit
def existing(constraints, rows):
    """Return those of the rows of an earlier update that still exist, distances last and in their order."""
    found, count = np.empty(len(rows), dtype=np.int64), 0
    for row in rows:
        if row < constraints.first:
            found[count] = row
            count += 1
    for row in constraints.row:
        if contains(rows, row):
            found[count] = row
            count += 1
    return found[:count]

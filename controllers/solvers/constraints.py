"""The inequality rows of one update's QP, in variables of local support, and which of them a point breaks.

A row `c_pᵀ s - a_p σ ≤ b_p` has a number, its key: first the slacks (σ ≥ 0, slacks.py), then the bounds of
accelerations (hard), the limits of velocity and position, and the distances of three kinds. Distances alone
are kept as coefficients; the others have one entry each in (q, v, u) of their stage.
"""

from typing import NamedTuple

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.slacks import LIMITS, SLACKS, VELOCITY_SLACK
from handrail.controllers.numerics.jit import jit

_HARD_TOLERANCE = 1e-7  # of a bound, relative
_TOLERANCE = 1e-5  # of a limit, relative
_DISTANCE_TOLERANCE = 1e-6  # [m]
_DISTANCE_SCALE = 10.0  # a violation of 0.1 m counts like one of a whole limit


class Constraints(NamedTuple):
    """Rows around a guess.

    Attributes:
        matrix: of basis.py, (3, 3).
        guess: accelerations relative to their limits, within ±1, (N, n).
        acceleration: limits, (n,).
        offsets: position and velocity after every stage relative to their limits, (N, 2, n).
        scales: what they are relative to, (2, n).
        stage: of every distance row, (R,).
        kind: of every distance row, which is its slack, (R,).
        coefficients: of its stage's variables, (R, 3n).
        upper: how much of each distance is left [m], (R,).
    """

    matrix: FloatArray
    guess: FloatArray
    acceleration: FloatArray
    offsets: FloatArray
    scales: FloatArray
    stage: IntArray
    kind: IntArray
    coefficients: FloatArray
    upper: FloatArray


@jit
def first_distance(horizon, n):
    """Return the key of the first distance row."""
    return SLACKS + 6 * horizon * n


@jit
def most_violated(rows, s, motion, slack, active):
    """Return the key of the row that a point breaks most, those already active left out; -1 if none.

    Args:
        rows: the constraints.
        s: the variables, (N n,).
        motion: changes of (q, v, u) after every stage, (N, 3, n).
        slack: σ, (4,).
        active: keys of the active rows, (A,).
    """
    worst, worst_key = 0.0, -1
    for index in range(SLACKS):
        if -slack[index] > max(worst, _HARD_TOLERANCE) and not _contains(active, index):
            worst, worst_key = -slack[index], index
    horizon, _, n = motion.shape
    limits = SLACKS + 2 * horizon * n
    for k in range(horizon):
        for j in range(n):
            value = rows.guess[k, j] + motion[k, 2, j] / rows.acceleration[j]
            excess = abs(value) - 1.0
            if excess > max(worst, _HARD_TOLERANCE):
                key = SLACKS + 2 * (k * n + j) + (value < 0.0)
                if not _contains(active, key):
                    worst, worst_key = excess, key
        for kind in range(2):
            allowed = 1.0 + slack[LIMITS] * (VELOCITY_SLACK if kind == 1 else 1.0)
            for j in range(n):
                value = rows.offsets[k, kind, j] + motion[k, kind, j] / rows.scales[kind, j]
                excess = abs(value) - allowed
                if excess > max(worst, _TOLERANCE):
                    key = limits + 2 * ((k * 2 + kind) * n + j) + (value < 0.0)
                    if not _contains(active, key):
                        worst, worst_key = excess, key
    base = first_distance(horizon, n)
    for row in range(len(rows.upper)):
        excess = _change(rows, row, n, s) - rows.upper[row] - slack[rows.kind[row]]
        scaled = _DISTANCE_SCALE * excess
        if excess > _DISTANCE_TOLERANCE and scaled > worst and not _contains(active, base + row):
            worst, worst_key = scaled, base + row
    return worst_key


@jit
def write_row(rows, key, out):
    """Write a row's coefficients of s and σ, (N n + 4,); return its right-hand side and first entry.

    The slacks' entries are written as they stand in the row: -1 for σ ≥ 0, else -a.
    """
    horizon, n = rows.guess.shape
    size = horizon * n
    for index in range(len(out)):
        out[index] = 0.0
    if key < SLACKS:
        out[size + key] = -1.0
        return 0.0, size
    key -= SLACKS
    if key < 2 * size:
        k, j, sign = key // 2 // n, key // 2 % n, 1.0 - 2.0 * (key % 2)
        first = _write_entry(rows.matrix[2], k, j, n, sign / rows.acceleration[j], out)
        return 1.0 - sign * rows.guess[k, j], first
    key -= 2 * size
    if key < 4 * size:
        k, kind, j, sign = key // 4 // n, key // 2 // n % 2, key // 2 % n, 1.0 - 2.0 * (key % 2)
        first = _write_entry(rows.matrix[kind], k, j, n, sign / rows.scales[kind, j], out)
        out[size + LIMITS] = -(VELOCITY_SLACK if kind == 1 else 1.0)
        return 1.0 - sign * rows.offsets[k, kind, j], first
    row = key - 4 * size
    start = (rows.stage[row] - 2) * n
    first = max(0, start)
    for column in range(first - start, 3 * n):
        out[start + column] = rows.coefficients[row, column]
    out[size + rows.kind[row]] = -1.0
    return rows.upper[row], first


@jit
def _contains(keys, key):
    found = False
    for index in range(len(keys)):
        found |= keys[index] == key
    return found


@jit
def _change(rows, row, n, s):
    """Return by how much a step brings a pair together."""
    start = (rows.stage[row] - 2) * n
    total = 0.0
    for column in range(max(0, -start), 3 * n):
        total += rows.coefficients[row, column] * s[start + column]
    return total


@jit
def _write_entry(shares, k, j, n, scale, out):
    """Write the coefficients of one entry of (q, v, u) of stage k; return the first of them."""
    first = k * n + j
    for a in range(3):
        index = (k - 2 + a) * n + j
        if index >= 0 and shares[a] != 0.0:
            out[index] = scale * shares[a]
            first = min(first, index)
    return first

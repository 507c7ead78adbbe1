"""A dual active-set method for the banded QP of one update.

    min ½ sᵀ H s + gᵀ s + Σ_i (ρ₁ σ_i + ½ ρ₂ σ_i²)   subject to   c_pᵀ s - a_p σ_i(p) ≤ b_p,  σ ≥ 0

with `H = L Lᵀ` banded and slacks σ. In `y = (Lᵀ s, √ρ₂ σ)` the objective is `½ ‖y + f‖²`, so that the
solution is the nearest point to `-f` within the rows `m_p = (L⁻¹ c_p, -a_p / √ρ₂)`. Rows become active one by
one, the most violated first, while all multipliers stay ≥ 0 (D. Goldfarb, A. Idnani, Mathematical Programming
27, 1983). Only rows that are met are ever transformed: one that is far from binding costs a comparison. Begun
with the rows that were active in the last update, it needs few changes.

Work is counted in numbers touched, `N n (active rows + band)` a change, never by the clock: the same update
takes the same work on every machine. An answer that has no work left is the nearest point within the rows
that are active so far; it may violate others.
"""

from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.slacks import SLACKS
from handrail.controllers.numerics.jit import copy, jit
from handrail.controllers.solvers.active_rows import active_rows, append, drop, project, settle
from handrail.controllers.solvers.banded import backward, factor, forward
from handrail.controllers.solvers.basis import to_motion
from handrail.controllers.solvers.constraints import Constraints, existing, most_violated, write_row

_DEPENDENT = 1e-12  # squared sine to the active rows, below which a row is a combination of them
_CHANGES = 10  # of the active rows, for each variable: an answer that takes more is none
_BAND = 30  # numbers touched for each variable and change besides the active rows
NOTHING_ACTIVE = np.arange(SLACKS)  # only the slacks are at rest: none is negative


class QuadraticProgram(NamedTuple):
    """The QP of one update.

    Attributes:
        band: H as a band, (N n, 3n); see banded.py. Solving overwrites it with its factor.
        gradient: g, (N n,).
        penalty: ρ₁ and ρ₂.
        constraints: of the update.
    """

    band: FloatArray
    gradient: FloatArray
    penalty: tuple[float, float]
    constraints: Constraints


class Answer(NamedTuple):
    """Whether there is one, σ (4,), change of the cost, changes of rows, the active ones, the work left."""

    solved: bool
    slack: FloatArray
    descent: float
    changes: int
    active: IntArray
    work_left: float = 0.0


class ActiveSet:
    """Solves the QPs of one update after another.

    Args:
        horizon: stages N.
        size: coordinates n.

    Attributes:
        motion: changes of (q, v, u) after every stage of the last solution, (N, 3, n).
    """

    def __init__(self, horizon: int, size: int) -> None:
        self.motion = np.zeros((horizon, 3, size))
        self._held = active_rows(horizon, size)

    def solve(
        self, program: QuadraticProgram, active: IntArray = NOTHING_ACTIVE, work: float = np.inf
    ) -> Answer:
        """Solve a QP, begun with the rows that are expected to be active, as those of the last one were.

        Args:
            program: the QP.
            active: numbers of the rows to begin with.
            work: that may be done; where it ends, the answer is the point reached.
        """
        changes = 0
        if factor(program.band):
            limit = _CHANGES * len(program.gradient)
            for warm in (active, NOTHING_ACTIVE):
                slack, descent, solved, changes, count, work = solve(
                    program, warm, limit, float(work), self._held, self.motion
                )
                if solved:
                    return Answer(True, slack, descent, changes, self._held.rows[:count].copy(), work)
        return Answer(False, np.zeros(SLACKS), 0.0, changes, NOTHING_ACTIVE)


@jit
def solve(program, warm, limit, work, held, motion):
    """Solve the QP; return σ (4,), `gᵀ s + ½ sᵀ H s`, whether there is an answer, changes, active, work left.

    Args:
        program: with L in place of H.
        warm: numbers of rows to begin with, those that do not exist left out, (k,).
        limit: of the number of changes.
        work: that may be done.
        held: room; the active rows' numbers and multipliers are left in it.
        motion: filled with the changes of (q, v, u) after every stage, (N, 3, n).
    """
    band, gradient, penalty, constraints = program
    size = len(gradient)
    root = penalty[1] ** 0.5
    free = np.empty(size + SLACKS)
    copy(gradient, size, free)
    forward(band, free, 0)
    for index in range(SLACKS):
        free[size + index] = penalty[0] / root
    y, new, normal = np.empty_like(free), np.empty_like(free), np.empty_like(free)
    along, shares = np.empty_like(free), np.empty_like(free)
    s, slack = np.empty(size), np.empty(SLACKS)
    warm = existing(constraints, warm)
    count = _begin(band, root, constraints, warm, free, held, y, new, along, shares, normal)
    work -= len(warm) * len(free) * (0.5 * len(warm) + _BAND)
    changes, settled = 0, 0
    while True:
        copy(y, size, s)
        backward(band, s)
        for index in range(SLACKS):
            slack[index] = y[size + index] / root
        to_motion(constraints.matrix, s, motion)
        row = most_violated(constraints, s, motion, slack, held.rows[:count])
        if row < 0 or work <= 0.0:
            if settled == changes or work <= 0.0:
                return slack, _descent(gradient, s, y), True, changes, count, work
            settled = changes  # without the rounding errors of the changes
            settle(held, count, free, shares, y)
            continue
        upper = _transform(band, root, constraints, row, new)
        multiplier = 0.0
        while True:
            changes += 1
            work -= len(free) * (count + _BAND)
            square = project(held, count, new, along, shares, normal)
            step, blocking = _step(held, count, new, upper, shares, square, y)
            if step == np.inf or changes > limit:
                return slack, 0.0, False, changes, count, work
            for i in range(count):
                held.multipliers[i] -= step * shares[i]
            multiplier += step
            if square > _DEPENDENT * np.dot(new, new):
                for t in range(len(y)):
                    y[t] -= step * normal[t]
            if blocking < 0:
                upper += np.dot(new, free)
                count = append(held, count, along, normal, square, row, upper, multiplier)
                break
            count = drop(held, count, blocking)


@jit
def _begin(band, root, constraints, warm, free, held, y, new, along, shares, normal):
    """Make the warm rows active, less those with a negative multiplier; write y; return their number."""
    count = 0
    for index in range(len(warm)):
        upper = _transform(band, root, constraints, warm[index], new) + np.dot(new, free)
        square = project(held, count, new, along, shares, normal)
        if square > _DEPENDENT * np.dot(new, new):
            count = append(held, count, along, normal, square, warm[index], upper, 0.0)
    while True:
        settle(held, count, free, shares, y)
        worst = -1
        for i in range(count):
            if held.multipliers[i] < (held.multipliers[worst] if worst >= 0 else 0.0):
                worst = i
        if worst < 0:
            return count
        count = drop(held, count, worst)


@jit
def _transform(band, root, constraints, row, new):
    """Write m_p of a row; return its right-hand side."""
    upper, first = write_row(constraints, row, new)
    forward(band, new, first)
    for index in range(len(band), len(new)):
        new[index] /= root
    return upper


@jit
def _step(held, count, new, upper, shares, square, y):
    """Return how far the new row's multiplier grows, and the active row that stops it; -1 if none."""
    step, blocking = np.inf, -1
    if square > _DEPENDENT * np.dot(new, new):
        step = max(np.dot(new, y) - upper, 0.0) / square
    for i in range(count):
        if shares[i] > 0.0 and held.multipliers[i] < step * shares[i]:
            step, blocking = max(held.multipliers[i], 0.0) / shares[i], i
    return step, blocking


@jit
def _descent(gradient, s, y):
    """Return `gᵀ s + ½ sᵀ H s`."""
    total = 0.0
    for t in range(len(s)):
        total += gradient[t] * s[t] + 0.5 * y[t] * y[t]
    return total

"""The inequality rows of one update's QP, in variables of local support, and which of them a point breaks.

A row `c_pᵀ s - a_p σ ≤ b_p` has a number: first come the slacks (σ ≥ 0, slacks.py), then the limits of the
joints, then those of the distances. The same row has the same number in every update.
"""

from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import Distances
from handrail.controllers.collision.slacks import SLACKS
from handrail.controllers.numerics.jit import jit
from handrail.controllers.ocp.nodes import Nodes
from handrail.controllers.ocp.problem import Problem
from handrail.controllers.solvers import distance_limits, joint_limits
from handrail.controllers.solvers.active_rows import contains

_TOLERANCE = 1e-7  # of a slack


class Constraints(NamedTuple):
    """All limits around a guess.

    Attributes:
        matrix: of basis.py, (3, 3).
        joints: limits of the joints.
        distances: limits of the distances.
    """

    matrix: FloatArray
    joints: joint_limits.JointLimits
    distances: distance_limits.DistanceLimits

    @property
    def broken(self) -> bool:
        """Whether the guess itself breaks a limit that is soft."""
        return self.joints.broken or bool(np.any(self.distances.left < 0.0))


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
    return Constraints(matrix, *_around(matrix, motion, bounds, pairs))


@jit
def _around(matrix, motion, bounds, pairs):
    joints = joint_limits.around(*motion, *bounds)
    first = SLACKS + 2 * joints.value.size
    return joints, distance_limits.around(matrix, *pairs, len(joints.value), first)


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
        if -slack[index] > max(worst, _TOLERANCE) and not contains(active, index):
            worst, row = -slack[index], index
    worst, row = joint_limits.most_violated(constraints.joints, motion, slack, active, worst, row)
    return distance_limits.most_violated(constraints.distances, s, slack, active, worst, row)[1]


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
    if row < constraints.distances.first:
        return joint_limits.write_row(constraints.joints, constraints.matrix, row, out)
    return distance_limits.write_row(constraints.distances, row, out, size)


@jit
def existing(constraints, rows):
    """Return those of the rows of an earlier update that still exist, distances last and in their order."""
    found, count = np.empty(len(rows), dtype=np.int64), 0
    for row in rows:
        if row < constraints.distances.first:
            found[count] = row
            count += 1
    for row in constraints.distances.row:
        if contains(rows, row):
            found[count] = row
            count += 1
    return found[:count]

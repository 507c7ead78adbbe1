"""The constraints of a problem, linearised around a guess."""

from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.model import Distances
from handrail.controllers.collision.slacks import LIMITS, SLACKS, VELOCITY_SLACK
from handrail.controllers.numerics.jit import jit
from handrail.controllers.ocp.nodes import Nodes
from handrail.controllers.ocp.problem import Problem
from handrail.controllers.solvers.basis import to_variables
from handrail.controllers.solvers.constraints import Constraints, first_distance

RECOVERY = 0.8  # of a distance deficit that is left after each node
_NODES = 1000  # more than there are in any plan


@dataclass(frozen=True)
class Rows:
    """Constraints, and names of the distance rows that last from update to update.

    Attributes:
        constraints: with keys that hold for this update only.
        names: of the distance rows, (R,): above all other keys, the same in the next update.
        needed: slacks that the guess itself needs, (4,).
        first: key of the first distance row.
    """

    constraints: Constraints
    names: IntArray
    needed: FloatArray
    first: int

    def any_distance(self, keys: IntArray) -> bool:
        """Whether there are distance rows among some keys."""
        return bool(_largest(keys) >= self.first)

    def keys(self, names: IntArray) -> IntArray:
        """Return the keys of rows that were named in an earlier update, as far as they still exist."""
        return _keys(names, self.names, self.first)

    def named(self, keys: IntArray) -> IntArray:
        """Return the lasting names of keys."""
        return _names(keys, self.names, self.first)


def rows_around(
    problem: Problem, motion: tuple[FloatArray, ...], nodes: Nodes, distances: Distances, matrix: FloatArray
) -> Rows:
    """Return the constraints around a guess.

    `d ≥ margin - deficit 0.8ᵏ` at every node k after now: a pair inside its margin recovers gradually.

    Args:
        problem: of the update.
        motion: q and v at the nodes, (N + 1, n), and u, (N, n), of the guess.
        nodes: of the guess.
        distances: there.
        matrix: of basis.py.
    """
    limits = problem.limits
    guess, offsets, scales, distance_rows, names, needed, first = _rows(
        matrix,
        *motion,
        (limits.position_lower, limits.position_upper, limits.velocity, limits.acceleration),
        distances.near,
        distances.gradients,
        distances.values,
        problem.margins,
        problem.collision.kinds,
        nodes.gains,
    )
    constraints = Constraints(matrix, guess, limits.acceleration, offsets, scales, *distance_rows)
    return Rows(constraints, names, needed, first)


@jit
def _rows(matrix, q, v, u, limits, near, gradients, values, margins, kinds, gains):
    lower, upper, velocity, acceleration = limits
    horizon, n = u.shape
    guess, offsets, scales = np.empty((horizon, n)), np.empty((horizon, 2, n)), np.empty((2, n))
    over = np.zeros(2)
    for j in range(n):
        scales[0, j], scales[1, j] = 0.5 * (upper[j] - lower[j]), velocity[j]
        middle = 0.5 * (upper[j] + lower[j])
        for k in range(horizon):
            guess[k, j] = u[k, j] / acceleration[j]
            offsets[k, 0, j] = (q[k + 1, j] - middle) / scales[0, j]
            offsets[k, 1, j] = v[k + 1, j] / scales[1, j]
            for kind in range(2):
                over[kind] = max(over[kind], abs(offsets[k, kind, j]) - 1.0)
    count = 0
    for row in range(len(near)):
        count += near[row, 0] > 0
    stage, kind = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    names = np.empty(count, dtype=np.int64)
    coefficients, left = np.empty((count, 3 * n)), np.empty(count)
    by_velocity, none = np.zeros(n), np.zeros(n)
    first = first_distance(horizon, n)
    needed = np.zeros(SLACKS)
    kept = 0
    for row in range(len(near)):
        node, pair = near[row]
        if node == 0:
            continue
        for j in range(n):
            gain = gains[node - horizon - 1, j] if node > horizon else 0.0
            by_velocity[j] = -gain * gradients[row, j]
        stage[kept] = min(node, horizon) - 1
        to_variables(matrix, -gradients[row], by_velocity, none, coefficients[kept])
        deficit = max(margins[pair] - values[0, pair], 0.0)
        left[kept] = values[node, pair] - margins[pair] + deficit * RECOVERY**node
        kind[kept] = kinds[pair]
        needed[kinds[pair]] = max(needed[kinds[pair]], -left[kept])
        names[kept] = first + pair * _NODES + node
        kept += 1
    needed[LIMITS] = max(over[0], over[1] / VELOCITY_SLACK)
    return guess, offsets, scales, (stage, kind, coefficients, left), names, needed, first


@jit
def _largest(keys):
    largest = -1
    for index in range(len(keys)):
        largest = max(largest, keys[index])
    return largest


@jit
def _keys(names, existing, first):
    """Return the keys of names: themselves below the first distance row, else where they are found."""
    keys, count = np.empty(len(names), dtype=np.int64), 0
    for name in names:
        if name < first:
            keys[count] = name
            count += 1
    for row in range(len(existing)):
        for name in names:
            if name == existing[row]:
                keys[count] = first + row
                count += 1
                break
    return keys[:count]


@jit
def _names(keys, existing, first):
    names = np.empty(len(keys), dtype=np.int64)
    for index in range(len(keys)):
        names[index] = keys[index] if keys[index] < first else existing[keys[index] - first]
    return names

"""Signed distances along a trajectory, linearised stage by stage."""

from dataclasses import dataclass, replace

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.ocp.nodes import Nodes
from handrail.controllers.ocp.problem import Problem
from handrail.controllers.solvers.reference.evaluation import distance_bounds

_BLOCK = 8  # the rows at a node are a multiple of this, so that few programs have to be built
_FREE = -1e3  # lower bound of a row that only fills up
_NOBODY = -1


@dataclass(frozen=True)
class LinearDistances:
    """Distances of R pairs at a node as rows `by_q q + by_v v + σ_kind ≥ lower`; rows of zeros fill up.

    Attributes:
        pairs: which pair a row is of; -1 where it only fills up, (N + 2, R).
        by_q: gradients by the position of the stage, (N + 2, R, n).
        by_v: gradients by the velocity of the stage, (N + 2, R, n); zero before the final stop.
        kind: of a row, which is its slack, (N + 2, R).
        lower: (N + 2, R).
    """

    pairs: IntArray
    by_q: FloatArray
    by_v: FloatArray
    kind: IntArray
    lower: FloatArray

    @property
    def rows(self) -> int:
        """Rows at a node R."""
        return self.lower.shape[1]

    def at(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Return `by_q q + by_v v` at the N + 1 nodes of a trajectory, (N + 2, R)."""
        stages = np.minimum(np.arange(1, len(self.lower) + 1), len(q) - 1)
        return np.einsum("krn,kn->kr", self.by_q, q[stages]) + np.einsum("krn,kn->kr", self.by_v, v[stages])

    def anchored(self, problem: Problem, u: FloatArray) -> "LinearDistances":
        """Return rows that are exact at other accelerations, with the same gradients."""
        q, v = problem.rollout(u)
        nodes = Nodes(problem, q, v)
        return self._exact(problem, problem.collision.values(nodes.q, nodes.times), q, v)

    def _exact(self, problem: Problem, values: FloatArray, q: FloatArray, v: FloatArray) -> "LinearDistances":
        bounds = distance_bounds(problem, values[0], len(values))
        needed = np.take_along_axis((bounds - values)[1:], np.maximum(self.pairs, 0), axis=1)
        return replace(self, lower=np.where(self.pairs == _NOBODY, _FREE, needed + self.at(q, v)))


def linear_distances(problem: Problem, u: FloatArray) -> LinearDistances:
    """Return the distances around accelerations (N, n), those that are within reach.

    `d + g (q - q̄) + σ ≥ bound`; at the final stop `q = q_N + c v_N |v_N| / a_max`, whose derivative by v_N is
    `2 c |v_N| / a_max`.
    """
    q, v = problem.rollout(u)
    nodes = Nodes(problem, q, v)
    found = problem.collision.distances(nodes.q, problem.active_within, nodes.times)
    keep = found.near[:, 0] > 0
    node, pair = found.near[keep].T
    counts = np.bincount(node, minlength=len(nodes.q))
    place = node - 1, np.arange(len(node)) - (np.cumsum(counts) - counts)[node]
    shape = (len(nodes.q) - 1, _BLOCK * -(-int(counts.max()) // _BLOCK))
    pairs, by_q = np.full(shape, _NOBODY), np.zeros((*shape, len(problem.q)))
    pairs[place], by_q[place] = pair, found.gradients[keep]
    by_v = np.zeros_like(by_q)
    by_v[problem.horizon :] = by_q[problem.horizon :] * nodes.gains[:, None, :]
    kind = np.append(problem.collision.kinds, 0)[pairs]  # -1 takes the last one, of nobody
    empty = LinearDistances(pairs, by_q, by_v, kind, np.zeros(shape))
    if not empty.rows:
        return empty
    return empty._exact(problem, found.values, q, v)

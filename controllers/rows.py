"""Inequality rows of the QP: linearised distances, and limits of velocity and position."""

from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray, IntArray
from handrail.controllers.collision import Distances
from handrail.controllers.problem import Problem

RECOVERY = 0.8  # of a distance deficit that is left after each node
_TOLERANCE = 1e-5  # of a limit, relative
VELOCITY_SLACK = 1e-3  # share of the slack that velocity limits get: they can always be kept
_NEAR = 0.9  # of a limit from which its row is in the QP from the start


@dataclass(frozen=True)
class Rows:
    """`A δ + S s ≤ upper` with δ (N n,) and two slacks: of the distances [m], of the limits (relative).

    Attributes:
        matrix: A and S side by side, (R, N n + 2).
        upper: right-hand side, (R,).
        keys: a number for each row that is the same in the next update, (R,).
    """

    matrix: FloatArray
    upper: FloatArray
    keys: IntArray

    def take(self, index: BoolArray) -> "Rows":
        """Return some of the rows."""
        return Rows(self.matrix[index], self.upper[index], self.keys[index])


class Nodes:
    """The configurations at which distances are asked for: after every stage, and along the final stop.

    The stop from node N at full deceleration passes `q_N + c v_N |v_N| / a_max` with c = 3/8 half way in
    time and c = 1/2 at rest.
    """

    STOPS = (0.375, 0.5)

    def __init__(self, problem: Problem, q: FloatArray, v: FloatArray, coefficients: FloatArray) -> None:
        stop = np.abs(v[-1]) / problem.limits.acceleration
        self.q = np.vstack([q, *(q[-1] + share * stop * v[-1] for share in self.STOPS)])
        end, longest = problem.dt * problem.horizon, float(stop.max())
        self.times = np.append(problem.dt * np.arange(len(q)), [end + 0.5 * longest, end + longest])
        self._coefficients = coefficients
        self._gains = np.array([2.0 * share * stop for share in self.STOPS])  # d(q)/d(v_N), (2, n)

    def sensitivity(self, node: IntArray) -> FloatArray:
        """Return dq/dδ of nodes after now, from 1 on, (R, N, n) or (R, N, 1): accelerations of each joint."""
        position, velocity = self._coefficients[:, 0], self._coefficients[:, 1]  # (N, N)
        horizon = len(position)
        result = position[np.minimum(node, horizon) - 1][:, :, None]
        late = node > horizon
        if not late.any():
            return result
        result = np.repeat(result, self._gains.shape[1], axis=2)
        result[late] += velocity[-1][None, :, None] * self._gains[node[late] - horizon - 1][:, None, :]
        return result


def distance_rows(problem: Problem, nodes: Nodes, distances: Distances) -> Rows:
    """Return `d ≥ bound` at every node after now; a pair inside its margin recovers gradually."""
    keep = distances.near[:, 0] > 0
    node, pair = distances.near[keep].T
    deficit = np.maximum(problem.margins - distances.values[0], 0.0)
    bound = problem.margins[pair] - deficit[pair] * RECOVERY**node
    count = len(node)
    matrix = np.zeros((count, problem.horizon * problem.q.size + 2))
    blocks = nodes.sensitivity(node) * distances.gradients[keep][:, None, :]
    np.negative(blocks.reshape(count, problem.horizon * problem.q.size), out=matrix[:, :-2])
    matrix[:, -2] = -1.0
    return Rows(matrix, distances.values[node, pair] - bound, pair * 1000 + node)


class LimitRows:
    """Velocity and position limits at the nodes; a row enters when it is near or violated."""

    def __init__(self, problem: Problem, q: FloatArray, v: FloatArray, coefficients: FloatArray) -> None:
        limits = problem.limits
        middle = 0.5 * (limits.position_upper + limits.position_lower)
        half = 0.5 * (limits.position_upper - limits.position_lower)
        self._coefficients = coefficients[:, :2]  # (N, 2, N): of q and v
        self._scales = np.stack([half, limits.velocity])  # (2, n)
        self._offsets = np.stack([q - middle, v], axis=1) / self._scales  # (N, 2, n), within ±1
        self._taken = np.zeros((*self._offsets.shape, 2), dtype=bool)

    @property
    def excess(self) -> float:
        """How far the guess exceeds a position limit, or a velocity limit by its share, relative."""
        over = np.abs(self._offsets).max(axis=(0, 2)) - 1.0  # (2,)
        return max(0.0, float(over[0]), float(over[1]) / VELOCITY_SLACK)

    def near(self) -> Rows | None:
        """Return the rows of limits that the guess comes close to; None when there are none."""
        return self._rows(np.stack([self._offsets, -self._offsets], axis=-1) > _NEAR)

    def violated(self, change: FloatArray, slack: float) -> Rows | None:
        """Return new rows for the limits that a change, (N, n), breaks beyond the slack; None if none."""
        values = self._offsets + (self._coefficients @ change) / self._scales
        allowed = 1.0 + slack * np.array([1.0, VELOCITY_SLACK])[:, None, None] + _TOLERANCE
        over = np.stack([values, -values], axis=-1) > allowed
        return self._rows(over & ~self._taken)

    def _rows(self, wanted: np.ndarray) -> Rows | None:
        new = np.argwhere(wanted)
        if not len(new):
            return None
        self._taken |= wanted
        horizon, _, size = self._offsets.shape
        node, kind, joint, side = new.T
        sign = 1.0 - 2.0 * side
        matrix = np.zeros((len(new), horizon * size + 2))
        blocks = matrix[:, :-2].reshape(len(new), horizon, size)
        scale = (sign / self._scales[kind, joint])[:, None]
        blocks[np.arange(len(new)), :, joint] = scale * self._coefficients[node, kind]
        matrix[:, :-2] = blocks.reshape(len(new), horizon * size)
        matrix[:, -1] = np.where(kind == 1, -VELOCITY_SLACK, -1.0)
        keys = 1_000_000 + np.asarray(np.ravel_multi_index(tuple(new.T), (*self._offsets.shape, 2)))
        return Rows(matrix, 1.0 - sign * self._offsets[node, kind, joint], keys)

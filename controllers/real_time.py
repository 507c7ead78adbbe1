"""The real-time solver: Gauss-Newton, states condensed out, one dense warm-started QP an update."""

from dataclasses import dataclass, field

import daqp
import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.objective import StageResiduals
from handrail.controllers.problem import Plan, Problem

_INFINITE = 1e30
_ROUNDS = 4  # of adding violated limit rows
_LIMIT_TOLERANCE = 1e-5  # relative


@dataclass
class _Rows:
    """Rows `A δ + S s ≤ upper` of the QP, gathered before it is built."""

    matrices: list[FloatArray] = field(default_factory=list)
    slacks: list[FloatArray] = field(default_factory=list)
    uppers: list[FloatArray] = field(default_factory=list)

    def add(self, matrix: FloatArray, slack: FloatArray, upper: FloatArray) -> None:
        self.matrices.append(np.hstack([matrix, slack]))
        self.uppers.append(upper)


class RealTimeSolver:
    """One Gauss-Newton step around a guess.

    Variables of the QP: the changes δ of the accelerations, (N n,), a slack of the distances [m] and a
    slack of the limits (relative). With `z = z̄ + C δ` for z = (q, v, u) of a stage, the cost is
    `½ Σ ‖r̄ + J C δ - ref‖²_W`. Rows of velocity and position limits enter when they are violated.
    """

    def __init__(self, residuals: StageResiduals, horizon: int, size: int, dt: float) -> None:
        self._residuals = residuals
        self._shape = (horizon, size)
        self._coefficients = _coefficients(horizon, dt)  # (N, 3, N)
        pairs = np.einsum("kaj,kbl->jlkab", self._coefficients, self._coefficients)
        self._pairs = pairs.reshape(horizon * horizon, -1)

    def solve(self, problem: Problem, guess: FloatArray) -> Plan:
        """Return the plan after one step from the accelerations `guess`, (N, n)."""
        guess = np.clip(guess, -problem.limits.acceleration, problem.limits.acceleration)
        q, v = problem.rollout(guess)
        hessian, gradient = self._cost(problem, q, v, guess)
        rows, distances = self._distance_rows(problem, q)
        change, slack, flag, iterations = self._solve_limited(problem, guess, q, v, hessian, gradient, rows)
        u = np.clip(guess + change, -problem.limits.acceleration, problem.limits.acceleration)
        q, v = problem.rollout(u)
        return Plan(q, v, u, float(slack[0]), float(slack[1]), distances, flag > 0, iterations)

    def _cost(
        self, problem: Problem, q: FloatArray, v: FloatArray, u: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return Hessian (N n + 2, N n + 2) and gradient (N n + 2,)."""
        horizon, size = self._shape
        values, transposed = self._residuals.evaluate(q[1:], v[1:], u)
        weighted = transposed * problem.weights[:, None, :]
        blocks = (weighted @ transposed.transpose(0, 2, 1)).reshape(horizon, 3, size, 3, size)
        flat = blocks.transpose(0, 1, 3, 2, 4).reshape(9 * horizon, size * size)
        hessian = np.zeros((horizon * size + 2,) * 2)
        condensed = (self._pairs @ flat).reshape(horizon, horizon, size, size)
        hessian[:-2, :-2] = condensed.transpose(0, 2, 1, 3).reshape(horizon * size, horizon * size)
        hessian[-2, -2] = hessian[-1, -1] = problem.slack_quadratic
        slopes = (weighted @ (values - problem.reference)[:, :, None]).reshape(3 * horizon, size)
        gradient = np.full(horizon * size + 2, problem.slack_linear)
        gradient[:-2] = (self._coefficients.reshape(3 * horizon, horizon).T @ slopes).ravel()
        return hessian, gradient

    def _distance_rows(self, problem: Problem, q: FloatArray) -> tuple[_Rows, FloatArray]:
        """Linearise `d ≥ bound` at the nodes after now; a pair inside its margin recovers gradually."""
        horizon, size = self._shape
        distances = problem.collision.distances(q, float(problem.margins.max()) + problem.reach)
        now = distances.values[0]
        keep = distances.near[:, 0] > 0
        node, pair = distances.near[keep].T
        deficit = np.maximum(problem.margins - now, 0.0)
        bound = problem.margins[pair] - deficit[pair] * 0.8**node
        coefficients = self._coefficients[node - 1, 0]  # (R, N)
        matrix = coefficients[:, :, None] * distances.gradients[keep][:, None, :]
        slack = np.tile([-1.0, 0.0], (len(node), 1))
        rows = _Rows()
        rows.add(-matrix.reshape(len(node), horizon * size), slack, distances.values[node, pair] - bound)
        return rows, now

    def _solve_limited(
        self,
        problem: Problem,
        guess: FloatArray,
        q: FloatArray,
        v: FloatArray,
        hessian: FloatArray,
        gradient: FloatArray,
        rows: _Rows,
    ) -> tuple[FloatArray, FloatArray, int, int]:
        """Solve; add the velocity and position limits that the solution breaks; solve again."""
        acceleration = np.tile(problem.limits.acceleration, (self._shape[0], 1))
        lower = np.concatenate([(-acceleration - guess).ravel(), [0.0, 0.0]])
        upper = np.concatenate([(acceleration - guess).ravel(), [_INFINITE, _INFINITE]])
        limits = _LimitRows(problem, self._coefficients, q[1:], v[1:])
        limits.add_violated(rows, np.zeros(self._shape), 0.0)
        total = 0
        for _ in range(_ROUNDS):
            matrix = np.vstack(rows.matrices)
            high = np.concatenate([upper, *rows.uppers])
            low = np.concatenate([lower, np.full(len(matrix), -_INFINITE)])
            solution, _, flag, info = daqp.solve(hessian, gradient, matrix, high, low)
            total += info["iterations"]
            change, slack = solution[:-2].reshape(self._shape), solution[-2:]
            if flag <= 0 or not limits.add_violated(rows, change, slack[1]):
                break
        return change, slack, flag, total


class _LimitRows:
    """Velocity and position limits at the nodes, each added to the QP once, when violated."""

    def __init__(self, problem: Problem, coefficients: FloatArray, q: FloatArray, v: FloatArray) -> None:
        limits = problem.limits
        middle = 0.5 * (limits.position_upper + limits.position_lower)
        half = 0.5 * (limits.position_upper - limits.position_lower)
        self._coefficients = coefficients[:, :2]  # (N, 2, N): of q and v
        self._scales = np.stack([half, limits.velocity])  # (2, n)
        self._offsets = np.stack([q - middle, v], axis=1) / self._scales  # (N, 2, n), within ±1
        self._taken = np.zeros((*self._offsets.shape, 2), dtype=bool)

    def add_violated(self, rows: _Rows, change: FloatArray, slack: float) -> bool:
        """Add rows for the limits that a change (N, n) breaks beyond the slack; return whether any."""
        values = self._offsets + np.einsum("kaj,jn->kan", self._coefficients, change) / self._scales
        over = np.stack([values, -values], axis=-1) > 1.0 + slack + _LIMIT_TOLERANCE
        new = np.argwhere(over & ~self._taken)
        if not len(new):
            return False
        self._taken |= over
        horizon, _, size = self._offsets.shape
        matrix = np.zeros((len(new), horizon, size))
        node, kind, joint, side = new.T
        sign = 1.0 - 2.0 * side
        matrix[np.arange(len(new)), :, joint] = (
            sign[:, None] * self._coefficients[node, kind] / self._scales[kind, joint][:, None]
        )
        slacks = np.tile([0.0, -1.0], (len(new), 1))
        rows.add(matrix.reshape(len(new), -1), slacks, 1.0 - sign * self._offsets[node, kind, joint])
        return True


def _coefficients(horizon: int, dt: float) -> FloatArray:
    """Return how (q, v, u) of stage k depend on the acceleration of stage j, (N, 3, N)."""
    stage, earlier = np.mgrid[:horizon, :horizon]
    past = stage >= earlier
    position = dt * dt * (stage - earlier + 0.5) * past
    return np.stack([position, dt * past, np.eye(horizon)], axis=1)

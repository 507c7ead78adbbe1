"""States condensed out: how positions and velocities depend on the accelerations, and the cost in them."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.problem import Problem
from handrail.controllers.residuals import StageResiduals

_CACHED = 64


class CondensedCost:
    """Gauss-Newton cost of the changes δ of the accelerations, (N n,), around a guess.

    With `z = z̄ + C δ` for z = (q, v, u) of a stage: `½ Σ ‖r̄ + J C δ - ref‖²_W`. Rows with a constant Jacobian
    give a Hessian that depends on the weights only; it is kept for every set of weights met.
    """

    def __init__(self, residuals: StageResiduals, horizon: int, size: int, dt: float) -> None:
        self.residuals = residuals
        self.coefficients = coefficients(horizon, dt)  # (N, 3, N)
        self._shape = (horizon, size)
        self._by_stage = self.coefficients.transpose(0, 2, 1)[:, None]  # (N, 1, N, 3)
        self._affine: dict[bytes, FloatArray] = {}

    def build(
        self, problem: Problem, q: FloatArray, v: FloatArray, u: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return Hessian (N n, N n) and gradient (N n,); q and v are after the stages, (N, n)."""
        hessian = self._affine_hessian(problem).copy()
        gradient = self._affine_gradient(problem, q, v, u)
        index = self.residuals.curved
        weights = problem.weights[:, index]
        used = np.flatnonzero(weights[0])
        self._last = None
        if len(used):
            values, jacobians = self.residuals.evaluate(q, v, u, problem.parameters)
            roots = np.sqrt(weights[:, used])
            error = roots * (values[:, used] - problem.reference[:, index[used]])
            rows = self._condense(jacobians[:, used] * roots[:, :, None])
            hessian += rows.T @ rows
            gradient += error.ravel() @ rows
            self._last = (used, roots, error, rows)
        return hessian, gradient

    def value(self, problem: Problem, q: FloatArray, v: FloatArray, u: FloatArray) -> float:
        """Return the cost itself, `½ Σ ‖r(q, v, u) - ref‖²_W`; q and v are after the stages, (N, n)."""
        affine, index = self.residuals.affine, self.residuals.curved
        error = np.hstack([q, v, u]) @ affine.jacobian.T + affine.offset - problem.reference[:, affine.index]
        total = np.vdot(problem.weights[:, affine.index], error * error)
        weights = problem.weights[:, index]
        if weights[0].any():
            values, _ = self.residuals.evaluate(q, v, u, problem.parameters)
            error = values - problem.reference[:, index]
            total += np.vdot(weights, error * error)
        return 0.5 * float(total)

    def tracking_error(self, problem: Problem, change: FloatArray) -> float:
        """Return the norm of the commanded twists' error at the last tracked stage, after a change (N, n).

        It is the linearised error of the last `build`; joint channels, which are always met when free, are
        left out.
        """
        if self._last is None:
            return 0.0
        used, roots, error, rows = self._last
        tracked = self.residuals.curved[used] < problem.channels
        stage = int(np.flatnonzero(roots[:, tracked].any(axis=1))[-1]) if tracked.any() else 0
        count = len(used)
        block = slice(stage * count, (stage + 1) * count)
        left = (error[stage] + rows[block] @ change.ravel())[tracked] / roots[stage, tracked]
        return float(np.sqrt(left @ left))

    def _condense(self, jacobians: FloatArray) -> FloatArray:
        """Return `J C` of all stages, (N rows, N n), from J by (q, v, u), (N, rows, 3n)."""
        horizon, size = self._shape
        parts = jacobians.reshape(horizon, -1, 3, size)  # (N, rows, 3, n)
        return (self._by_stage @ parts).reshape(-1, horizon * size)

    def _affine_hessian(self, problem: Problem) -> FloatArray:
        affine = self.residuals.affine
        weights = problem.weights[:, affine.index]
        key = weights.tobytes()
        if key not in self._affine:
            if len(self._affine) >= _CACHED:
                self._affine.clear()
            jacobians = np.sqrt(weights)[:, :, None] * affine.jacobian[None]
            rows = self._condense(jacobians)
            self._affine[key] = rows.T @ rows
        return self._affine[key]

    def _affine_gradient(self, problem: Problem, q: FloatArray, v: FloatArray, u: FloatArray) -> FloatArray:
        horizon, size = self._shape
        affine = self.residuals.affine
        values = np.hstack([q, v, u]) @ affine.jacobian.T + affine.offset
        slopes = problem.weights[:, affine.index] * (values - problem.reference[:, affine.index])
        by_state = (slopes @ affine.jacobian).reshape(3 * horizon, size)
        return (self.coefficients.reshape(3 * horizon, horizon).T @ by_state).ravel()


def coefficients(horizon: int, dt: float) -> FloatArray:
    """Return how (q, v, u) of stage k depend on the acceleration of stage j, (N, 3, N)."""
    stage, earlier = np.mgrid[:horizon, :horizon]
    past = stage >= earlier
    position = dt * dt * (stage - earlier + 0.5) * past
    return np.stack([position, dt * past, np.eye(horizon)], axis=1)

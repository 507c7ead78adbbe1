"""The Gauss-Newton cost of all stages in variables of local support (basis.py): value, gradient, Hessian."""

from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.basis import REACH, stage_matrix, to_variables
from handrail.controllers.jit import jit
from handrail.controllers.problem import Problem
from handrail.controllers.residuals import StageResiduals

_CACHED = 64


@dataclass(frozen=True)
class Quadratic:
    """`value + gᵀ s + ½ sᵀ H s`; the arrays belong to the cost and last until its next `expand`.

    Attributes:
        value: `½ Σ ‖r - ref‖²_W` at the guess.
        gradient: g, (N n,).
        band: H as a band, (N n, 3n); see banded.py.
    """

    value: float
    gradient: FloatArray
    band: FloatArray


class StageCost:
    """`½ Σ_k ‖r(z_k) - ref_k‖²_W_k` of z = (q, v, u) after every stage.

    Rows with a constant Jacobian give a Hessian that depends on the weights only; it is kept for every set
    of weights met.
    """

    def __init__(self, residuals: StageResiduals, horizon: int, size: int, dt: float) -> None:
        self.residuals = residuals
        self.matrix = stage_matrix(dt)
        self._shape = (horizon, size)
        self._affine = _sparse(residuals.affine.jacobian, residuals.affine.offset, residuals.affine.index)
        self._curved = residuals.curved
        self._gradient = np.zeros(horizon * size)
        self._band = np.zeros((horizon * size, REACH * size))
        self._constant: dict[bytes, FloatArray] = {}

    def expand(self, problem: Problem, q: FloatArray, v: FloatArray, u: FloatArray) -> Quadratic:
        """Return the quadratic around a guess; q and v are after the stages, (N, n)."""
        self._band[:] = self._constant_band(problem.weights)
        self._gradient[:] = 0.0
        values, jacobians = self.residuals.evaluate(q, v, u, problem.parameters)
        value = _add_affine(
            self._affine, self.matrix, q, v, u, problem.weights, problem.reference, self._gradient
        )
        value += _add_curved(
            self._curved,
            self.matrix,
            values,
            jacobians,
            problem.weights,
            problem.reference,
            self._gradient,
            self._band,
        )
        return Quadratic(value, self._gradient, self._band)

    def value(self, problem: Problem, q: FloatArray, v: FloatArray, u: FloatArray) -> float:
        """Return the cost itself; q and v are after the stages, (N, n)."""
        values, _ = self.residuals.evaluate(q, v, u, problem.parameters)
        value = _affine_value(self._affine, q, v, u, problem.weights, problem.reference)
        return value + _curved_value(self._curved, values, problem.weights, problem.reference)

    def tracking_error(self, problem: Problem, q: FloatArray, v: FloatArray, u: FloatArray) -> float:
        """Return the norm of the commanded twists' error at the last tracked stage.

        Joint channels, which are always met when free, are left out.
        """
        values, _ = self.residuals.evaluate(q, v, u, problem.parameters)
        index = self._curved
        tracked = index < problem.channels
        weights = problem.weights[:, index[tracked]]
        stages = np.flatnonzero(weights.any(axis=1))
        if not len(stages):
            return 0.0
        error = values[stages[-1], tracked] - problem.reference[stages[-1], index[tracked]]
        return float(np.linalg.norm(error[weights[stages[-1]] > 0.0]))

    def _constant_band(self, weights: FloatArray) -> FloatArray:
        key = weights.tobytes()
        if key not in self._constant:
            if len(self._constant) >= _CACHED:
                self._constant.clear()
            band = np.zeros_like(self._band)
            index, jacobian = self.residuals.affine.index, self.residuals.affine.jacobian
            horizon = self._shape[0]
            jacobians = np.broadcast_to(jacobian.T, (horizon, *jacobian.T.shape)).copy()
            zeros = np.zeros((horizon, len(index)))
            _add_curved(
                index,
                self.matrix,
                zeros,
                jacobians.transpose(0, 2, 1),
                weights,
                np.zeros_like(weights),
                np.zeros_like(self._gradient),
                band,
            )
            self._constant[key] = band
        return self._constant[key]


def _sparse(matrix: FloatArray, offset: FloatArray, index: FloatArray) -> tuple[FloatArray, ...]:
    """Return a matrix by its rows: where each begins, columns, values; offsets; and where the rows lie."""
    row, column = np.nonzero(matrix)
    begins = np.searchsorted(row, np.arange(len(matrix) + 1))
    return begins, column, matrix[row, column], offset, index


@jit
def _affine_error(affine, row, z, reference):  # noqa: ANN001, ANN202
    begins, columns, values, offset, index = affine
    error = offset[row] - reference[index[row]]
    for entry in range(begins[row], begins[row + 1]):
        error += values[entry] * z[columns[entry]]
    return error


@jit
def _affine_value(affine, q, v, u, weights, reference):  # noqa: ANN001, ANN202
    horizon, n = q.shape
    z = np.empty(3 * n)
    total = 0.0
    index = affine[4]
    for k in range(horizon):
        z[:n], z[n : 2 * n], z[2 * n :] = q[k], v[k], u[k]
        for row in range(len(index)):
            weight = weights[k, index[row]]
            if weight > 0.0:
                total += weight * _affine_error(affine, row, z, reference[k]) ** 2
    return 0.5 * total


@jit
def _add_affine(affine, matrix, q, v, u, weights, reference, gradient):  # noqa: ANN001, ANN202
    """Add the gradient of the affine rows; return their cost."""
    begins, columns, values, _, index = affine
    horizon, n = q.shape
    z, slope, row_slope = np.empty(3 * n), np.empty(3 * n), np.empty(3 * n)
    total = 0.0
    for k in range(horizon):
        z[:n], z[n : 2 * n], z[2 * n :] = q[k], v[k], u[k]
        slope[:] = 0.0
        for row in range(len(index)):
            weight = weights[k, index[row]]
            if weight > 0.0:
                error = _affine_error(affine, row, z, reference[k])
                total += weight * error * error
                for entry in range(begins[row], begins[row + 1]):
                    slope[columns[entry]] += weight * error * values[entry]
        to_variables(matrix, slope[:n], slope[n : 2 * n], slope[2 * n :], row_slope)
        start = (k - 2) * n
        for column in range(max(0, -start), 3 * n):
            gradient[start + column] += row_slope[column]
    return 0.5 * total


@jit
def _curved_value(curved, values, weights, reference):  # noqa: ANN001, ANN202
    total = 0.0
    for k in range(len(values)):
        for row in range(len(curved)):
            weight = weights[k, curved[row]]
            if weight > 0.0:
                total += weight * (values[k, row] - reference[k, curved[row]]) ** 2
    return 0.5 * total


@jit
def _add_curved(index, matrix, values, jacobians, weights, reference, gradient, band):  # noqa: ANN001, ANN202
    """Add gradient and Gauss-Newton Hessian of rows with a Jacobian at every stage; return their cost."""
    horizon, rows, width = jacobians.shape
    n = width // 3
    row_of_variables = np.empty(width)
    total = 0.0
    for k in range(horizon):
        start = (k - 2) * n
        first = max(0, -start)
        for row in range(rows):
            weight = weights[k, index[row]]
            if weight > 0.0:
                error = values[k, row] - reference[k, index[row]]
                total += weight * error * error
                jacobian = jacobians[k, row]
                to_variables(
                    matrix, jacobian[:n], jacobian[n : 2 * n], jacobian[2 * n :], row_of_variables
                )
                for a in range(first, width):
                    share = weight * row_of_variables[a]
                    if share != 0.0:
                        gradient[start + a] += share * error
                        for b in range(a, width):
                            band[start + a, b - a] += share * row_of_variables[b]
    return 0.5 * total

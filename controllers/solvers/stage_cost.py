"""The Gauss-Newton cost of all stages in variables of local support (basis.py): value, gradient, Hessian."""

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.numerics.jit import jit
from handrail.controllers.ocp.problem import Problem
from handrail.controllers.ocp.residuals import StageResiduals
from handrail.controllers.solvers.basis import REACH, stage_matrix, to_variables

_CACHED = 64


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

    def expand(
        self, problem: Problem, q: FloatArray, v: FloatArray, u: FloatArray
    ) -> tuple[float, FloatArray, FloatArray]:
        """Return the cost `value + gᵀ s + ½ sᵀ H s` around a guess: value, g (N n,), H as a band (N n, 3n).

        See banded.py for the band; both arrays last until the next `expand`.

        Args:
            problem: of the update.
            q: positions at the nodes, (N + 1, n).
            v: velocities there, (N + 1, n).
            u: accelerations, (N, n).
        """
        self._band[:] = self._constant_band(problem.weights)
        self._gradient[:] = 0.0
        z, values, jacobians = self.residuals.evaluate(q[1:], v[1:], u, problem.parameters)
        asked, found = (problem.weights, problem.reference), (self._gradient, self._band)
        value = _add_affine(self._affine, self.matrix, z, *asked, self._gradient)
        value += _add_curved(self._curved, self.matrix, values, jacobians, *asked, *found)
        return value, self._gradient, self._band

    def value(self, problem: Problem, q: FloatArray, v: FloatArray, u: FloatArray) -> float:
        """Return the cost itself of q and v at the nodes, (N + 1, n), and u, (N, n)."""
        z, values = self.residuals.values(q[1:], v[1:], u, problem.parameters)
        return _value(self._affine, self._curved, z, values, problem.weights, problem.reference)

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
                jacobians,
                weights,
                np.zeros_like(weights),
                np.zeros_like(self._gradient),
                band,
            )
            self._constant[key] = band
        return self._constant[key]


def _sparse(matrix: FloatArray, offset: FloatArray, index: IntArray) -> tuple[FloatArray | IntArray, ...]:
    """Return a matrix by its rows: where each begins, columns, values; offsets; and where the rows lie."""
    row, column = np.nonzero(matrix)
    begins = np.searchsorted(row, np.arange(len(matrix) + 1))
    return begins, column, matrix[row, column], offset, index


@jit
def _affine_error(affine, row, z, reference):
    begins, columns, values, offset, index = affine
    error = offset[row] - reference[index[row]]
    for entry in range(begins[row], begins[row + 1]):
        error += values[entry] * z[columns[entry]]
    return error


@jit
def _value(affine, curved, z, values, weights, reference):
    total = 0.0
    index = affine[4]
    for k in range(len(z)):
        for row in range(len(index)):
            weight = weights[k, index[row]]
            if weight > 0.0:
                total += weight * _affine_error(affine, row, z[k], reference[k]) ** 2
        for row in range(len(curved)):
            weight = weights[k, curved[row]]
            if weight > 0.0:
                total += weight * (values[k, row] - reference[k, curved[row]]) ** 2
    return 0.5 * total


@jit
def _add_affine(affine, matrix, z, weights, reference, gradient):
    """Add the gradient of the affine rows; return their cost."""
    begins, columns, values, _, index = affine
    horizon, width = z.shape
    n = width // 3
    slope, by_variables = np.empty(width), np.empty(width)
    total = 0.0
    for k in range(horizon):
        for column in range(width):
            slope[column] = 0.0
        for row in range(len(index)):
            weight = weights[k, index[row]]
            if weight > 0.0:
                error = _affine_error(affine, row, z[k], reference[k])
                total += weight * error * error
                for entry in range(begins[row], begins[row + 1]):
                    slope[columns[entry]] += weight * error * values[entry]
        to_variables(matrix, slope[:n], slope[n : 2 * n], slope[2 * n :], by_variables)
        start = (k - 2) * n
        for column in range(max(0, -start), width):
            gradient[start + column] += by_variables[column]
    return 0.5 * total


@jit
def _add_curved(index, matrix, values, jacobians, weights, reference, gradient, band):
    """Add gradient and Gauss-Newton Hessian of rows with a Jacobian at every stage; return their cost.

    The Jacobians are column by column, as CasADi writes them: (N, 3n, rows).
    """
    horizon, width, rows = jacobians.shape
    n = width // 3
    by_variables = np.empty(width)
    total = 0.0
    for k in range(horizon):
        start = (k - 2) * n
        first = max(0, -start)
        for row in range(rows):
            weight = weights[k, index[row]]
            if weight > 0.0:
                error = values[k, row] - reference[k, index[row]]
                total += weight * error * error
                columns = jacobians[k, :, row]
                to_variables(matrix, columns[:n], columns[n : 2 * n], columns[2 * n :], by_variables)
                for a in range(first, width):
                    share = weight * by_variables[a]
                    if share != 0.0:
                        gradient[start + a] += share * error
                        for b in range(a, width):
                            band[start + a, b - a] += share * by_variables[b]
    return 0.5 * total

"""The QP of one update as dense matrices, as other solvers want it."""

from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.slacks import SLACKS
from handrail.controllers.solvers.active_set import QuadraticProgram
from handrail.controllers.solvers.constraints import write_row


@dataclass(frozen=True)
class DenseProgram:
    """`min ½ xᵀ H x + gᵀ x` subject to `A x ≤ b`, x = (s, σ).

    Attributes:
        hessian: H, (m, m).
        gradient: g, (m,).
        matrix: A, (r, m).
        upper: b, (r,).
        rows: numbers of the rows, (r,).
    """

    hessian: FloatArray
    gradient: FloatArray
    matrix: FloatArray
    upper: FloatArray
    rows: IntArray

    def value(self, x: FloatArray) -> float:
        """Return the objective, (m,)."""
        return float(0.5 * x @ self.hessian @ x + self.gradient @ x)

    def violation(self, x: FloatArray) -> float:
        """Return by how much the row that is broken most is."""
        return float(np.max(self.matrix @ x - self.upper))


def dense(program: QuadraticProgram) -> DenseProgram:
    """Return a QP, whose H is not yet factored, as dense matrices."""
    band, gradient, (linear, quadratic), constraints = program
    size = len(gradient)
    hessian = np.diag(np.full(size + SLACKS, quadratic))
    for j in range(size):
        column = band[j, : size - j]
        hessian[j, j : j + len(column)] = hessian[j : j + len(column), j] = column
    rows = np.append(np.arange(constraints.first), constraints.row)
    matrix, upper = np.empty((len(rows), size + SLACKS)), np.empty(len(rows))
    for index, row in enumerate(rows):
        upper[index], _ = write_row(constraints, row, matrix[index])
    return DenseProgram(hessian, np.append(gradient, np.full(SLACKS, linear)), matrix, upper, rows)

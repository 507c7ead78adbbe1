"""The QP of one update as dense matrices, as other solvers want it."""

from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.slacks import SLACKS
from handrail.controllers.core.library import Memory, functions


@dataclass(frozen=True)
class DenseProgram:
    """`min ½ xᵀ H x + gᵀ x` subject to `A x ≤ b`, x = (s, σ)."""

    hessian: FloatArray  # H, (m, m)
    gradient: FloatArray  # g, (m,)
    matrix: FloatArray  # A, (r, m)
    upper: FloatArray  # b, (r,)
    rows: IntArray  # their numbers, (r,)


def dense(core: Memory, scene: Memory) -> DenseProgram:
    """Return the QP that stands in the core, its H not yet factored, as dense matrices."""
    size = core.fields.M
    hessian = np.diag(np.full(size + SLACKS, core.fields.quadratic))
    for j in range(size):
        column = core.band[j, : size - j]
        hessian[j, j : j + len(column)] = hessian[j : j + len(column), j] = column
    first = SLACKS + 6 * size
    rows = np.append(np.arange(first), core.number[: core.fields.count])
    matrix, upper = np.empty((len(rows), size + SLACKS)), np.empty(len(rows))
    for place in range(len(rows)):
        upper[place] = functions().write_row(core, scene, place, matrix[place], np.zeros(1, dtype=np.int64))
    return DenseProgram(
        hessian, np.append(core.slope, np.full(SLACKS, core.fields.linear)), matrix, upper, rows
    )

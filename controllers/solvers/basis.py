"""Motions with local support: the variables in which the optimal control problem is banded.

The accelerations of a double integrator reach all later states. With second differences of s instead,

    u_k = s_k - 2 s_{k-1} + s_{k-2},   v_k = dt (s_k - s_{k-1}),   q_k = ½ dt² (s_k + s_{k-1}),

for the changes after stage k (s = 0 before the first), every stage depends on three neighbours only, so that
the Hessian has a band of 3n and a solution costs as much for each stage more. Variables lie stage by stage:
`s[k n + j]`; those of stage k, `(s_{k-2}, s_{k-1}, s_k)`, begin at `(k - 2) n`.
"""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.jit import jit

REACH = 3  # stages that one stage depends on


def stage_matrix(dt: float) -> FloatArray:
    """Return how (q, v, u) of a stage depend on (s_{k-2}, s_{k-1}, s_k), (3, 3)."""
    half = 0.5 * dt * dt
    return np.array([[0.0, half, half], [0.0, -dt, dt], [1.0, -2.0, 1.0]])


@jit
def to_variables(matrix, q, v, u, out):
    """Write a row of (q, v, u), (n,) each, as a row of a stage's variables, (3n,)."""
    n = len(q)
    for a in range(REACH):
        for j in range(n):
            out[a * n + j] = matrix[0, a] * q[j] + matrix[1, a] * v[j] + matrix[2, a] * u[j]


@jit
def to_motion(matrix, s, out):
    """Write the changes of (q, v, u) after every stage, (N, 3, n), of variables s, (N n,)."""
    horizon, _, n = out.shape
    for k in range(horizon):
        for part in range(3):
            for j in range(n):
                total = matrix[part, 2] * s[k * n + j]
                if k > 0:
                    total += matrix[part, 1] * s[(k - 1) * n + j]
                if k > 1:
                    total += matrix[part, 0] * s[(k - 2) * n + j]
                out[k, part, j] = total

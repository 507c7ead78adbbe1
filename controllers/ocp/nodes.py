"""The configurations of a plan at which distances are asked for."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.jit import copy, jit
from handrail.controllers.ocp.problem import Problem


class Nodes:
    """Now, after every stage, and along the final stop.

    The stop from node N at full deceleration passes `q_N + c v_N |v_N| / a_max` with c = 3/8 half way in
    time and c = 1/2 at rest.

    Attributes:
        q: configurations, (N + 3, n).
        times: from now on, (N + 3,) [s].
        gains: derivative of the stop's two configurations by v_N, (2, n) [s].
    """

    STOPS = (0.375, 0.5)

    def __init__(self, problem: Problem, q: FloatArray, v: FloatArray) -> None:
        self.q, self.times, self.gains = _nodes(q, v, problem.limits.acceleration, problem.dt, self.STOPS)


@jit
def _nodes(q, v, acceleration, dt, shares):
    count, n = q.shape
    nodes, times = np.empty((count + len(shares), n)), np.empty(count + len(shares))
    gains = np.empty((len(shares), n))
    longest = 0.0
    for k in range(count):
        times[k] = dt * k
        copy(q[k], n, nodes[k])
    for j in range(n):
        stop = abs(v[count - 1, j]) / acceleration[j]
        longest = max(longest, stop)
        for index, share in enumerate(shares):
            gains[index, j] = 2.0 * share * stop
            nodes[count + index, j] = q[count - 1, j] + share * stop * v[count - 1, j]
    for index in range(len(shares)):
        times[count + index] = times[count - 1] + longest * (index + 1) / len(shares)
    return nodes, times, gains

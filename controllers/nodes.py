"""The configurations of a plan at which distances are asked for."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.problem import Problem


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
        count = len(q)
        stop = np.abs(v[-1]) / problem.limits.acceleration
        self.gains = 2.0 * np.multiply.outer(self.STOPS, stop)
        self.q = np.empty((count + 2, q.shape[1]))
        self.q[:count] = q
        self.q[count:] = q[-1] + 0.5 * self.gains * v[-1]
        self.times = problem.dt * np.arange(count + 2)
        longest = float(stop.max())
        self.times[count:] = self.times[count - 1] + 0.5 * longest, self.times[count - 1] + longest

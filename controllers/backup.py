"""The certificate that the robot can always stop: a command is sent only if the stop after it is safe."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision import CollisionModel
from handrail.controllers.limiter import Limiter

_SAMPLES = np.array([0.25, 0.5, 0.75, 1.0])  # of the time that a stop takes
_ERROR = 1e-3  # of the signed distances that is no loss [m]


class StopCertificate:
    """Measures the stop that follows a command, at full deceleration of every joint.

    From (q, v): `q_j(t) = q_j + v_j t - ½ sign(v_j) a_j t²` until `t_j = |v_j| / a_j`. The stop is safe when
    no pair comes below its floor, or, where one is below already, no closer than now.

    Args:
        limiter: knows the deceleration.
        collision: the pairs.
        floors: of each pair [m], (P,).
    """

    def __init__(self, limiter: Limiter, collision: CollisionModel, floors: FloatArray) -> None:
        self._limiter = limiter
        self._collision = collision
        self._floors = floors

    def shortfall(
        self, q: FloatArray, v: FloatArray, now: tuple[FloatArray, FloatArray], delay: float = 0.0
    ) -> float:
        """Return how far the stop from (q, v) falls short of what is asked; 0 when it is safe [m].

        Args:
            q: where it begins, (n,).
            v: how fast, (n,).
            now: the position now, (n,), and its distances, (P,).
            delay: time until it begins [s].
        """
        path, times = self._limiter.stop(q, v, _SAMPLES)
        distances = self._collision.values(path, delay + times, now)
        asked = np.minimum(self._floors, now[1] - _ERROR)
        return float(np.max(asked - distances, initial=0.0))

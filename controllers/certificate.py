"""The certificate that a motion is safe: no pair comes below its floor, no joint beyond its range."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision import CollisionModel
from handrail.controllers.description import Limits
from handrail.controllers.limiter import Limiter

_SAMPLES = np.array([0.25, 0.5, 0.75, 1.0])  # of the time that a stop takes
_ERROR = 1e-3  # of signed distances, that is no loss [m]
_BEYOND = 0.01  # of its range that a joint may come to rest [m, rad]


class StopCertificate:
    """Measures motions by exact distances; moving obstacles go on at constant velocity.

    A motion is safe when no pair comes below its floor and no joint leaves its range, or, where one is
    beyond already, no farther than now.

    Args:
        limiter: knows the full stop.
        collision: the pairs.
        floors: of each pair [m], (P,).
        limits: of the joints.
    """

    def __init__(
        self, limiter: Limiter, collision: CollisionModel, floors: FloatArray, limits: Limits
    ) -> None:
        self._limiter = limiter
        self._collision = collision
        self._floors = floors
        self._limits = limits

    def shortfall(
        self, q: FloatArray, v: FloatArray, now: tuple[FloatArray, FloatArray], delay: float = 0.0
    ) -> float:
        """Return how far the full stop from (q, v) falls short of safety; 0 when it is safe [m, rad].

        At full deceleration of every joint: `q_j(t) = q_j + v_j t - ½ sign(v_j) a_j t²` until `|v_j| / a_j`.

        Args:
            q: where it begins, (n,).
            v: how fast, (n,).
            now: the position now, (n,), and its distances, (P,).
            delay: time until it begins [s].
        """
        path, times = self._limiter.stop(q, v, _SAMPLES)
        return float(self.along(path, delay + times, now).max())

    def along(self, path: FloatArray, times: FloatArray, now: tuple[FloatArray, FloatArray]) -> FloatArray:
        """Return the same at every point of a motion through positions (K, n) at times from now, (K,)."""
        distances = self._collision.values(path, times, now)
        asked = np.minimum(self._floors, now[1] - _ERROR)
        short = np.max(asked - distances, axis=1, initial=0.0)
        asked = np.minimum(0.0, self._room(now[0])) - _BEYOND
        return np.maximum(short, np.max(asked - self._room(path), axis=1))

    def _room(self, q: FloatArray) -> FloatArray:
        """Return how far each joint is inside its range, (…, n)."""
        return np.minimum(q - self._limits.position_lower, self._limits.position_upper - q)

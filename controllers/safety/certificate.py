"""The certificate that a motion is safe: no pair comes too near, no joint beyond its range."""

from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.core.library import Memory, functions

_WAITING = np.array([0.25, 0.5, 0.75, 1.0])  # of the time that a robot waits after it has stopped


class Violation(NamedTuple):
    """How far a motion falls short of safety; of two the smaller is safer. 0 when it is safe [m, rad]."""

    hard: float
    """Of the hard limits of the robot with itself and with what stands still, and of the joints' range.
    Nobody else moves these: what was safe once stays safe, and nothing is worth giving it up."""
    all: float  # of all least distances


class StopCertificate(NamedTuple):
    """Measures motions by exact distances; moving obstacles go on at constant velocity.

    A motion is safe when no pair comes below its least distance and no joint leaves its range, or, where one
    is beyond already, no farther than now.
    """

    collision: CollisionModel  # the pairs, and the limits of the robot
    least: FloatArray  # distance of each pair that is kept, (P,) [m]
    span: float  # time for which the robot has to be safe, where obstacles move [s]
    lag: FloatArray | None = None
    """How far the robot is from where it is expected, (n,): a motion has to be safe there, too."""

    def violation(
        self, q: FloatArray, v: FloatArray, now: tuple[FloatArray, FloatArray], delay: float = 0.0
    ) -> Violation:
        """Return how far the full stop from (q, v) falls short of safety.

        At full deceleration of every joint: `q_j(t) = q_j + v_j t - ½ sign(v_j) a_j t²` until `|v_j| / a_j`.

        Args:
            q: where it begins, (n,).
            v: how fast, (n,).
            now: the position now, (n,), and its distances, (P,).
            delay: time until it begins [s].
        """
        memory = self._facing(now)
        memory.stop_q[:], memory.stop_v[:] = q, v
        functions().stop_violation(memory, delay, self.span, self.lag)
        self.collision.check()
        return Violation(*memory.violation.tolist())

    def until_rest(
        self, path: FloatArray, times: FloatArray, now: tuple[FloatArray, FloatArray]
    ) -> Violation:
        """Return the same of a motion that ends at rest, through positions (K, n) at times from now, (K,).

        Where obstacles move, the robot has to be safe for some time, moving or waiting.
        """
        left = self.span - times[-1]
        if self.collision.any_moving and left > 0.0:
            path = np.vstack([path, np.broadcast_to(path[-1], (len(_WAITING), path.shape[1]))])
            times = np.append(times, times[-1] + left * _WAITING)
        return Violation(*self.along(path, times, now).max(axis=0).tolist())

    def along(self, path: FloatArray, times: FloatArray, now: tuple[FloatArray, FloatArray]) -> FloatArray:
        """Return the same at every point of a motion, hard and of all, (K, 2)."""
        if self.lag is not None:
            path, times = np.vstack([path, path + self.lag]), np.tile(times, 2)
        path, found = np.ascontiguousarray(path), np.empty((len(path), 2))
        functions().path_violations(self._facing(now), len(path), path, times, found)
        self.collision.check()
        return found if self.lag is None else np.maximum(*np.split(found, 2))

    def _facing(self, now: tuple[FloatArray, FloatArray]) -> Memory:
        """Return the compiled core's scene, in which motions begin here and have to keep these distances."""
        memory = self.collision.memory
        memory.least[:], (memory.start[:], memory.start_distances[:]) = self.least, now
        return memory

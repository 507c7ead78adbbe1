"""To and fro between two points: how an obstacle moves by itself."""

from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError


@dataclass(frozen=True)
class Patrol:
    """From a point to another at a constant speed, back, and again: a function of time alone.

    Attributes:
        start: where it is at time 0 [m], (3,).
        end: where it turns [m], (3,).
        speed: [m/s].
    """

    start: FloatArray
    end: FloatArray
    speed: float

    def __post_init__(self) -> None:
        """Copy the arrays and make them read-only."""
        for name in ("start", "end"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        if not self.length > 0 or not 0 < self.speed < np.inf:
            raise HandrailError(
                "patrol: expected two points and a positive speed [m/s], "
                f"got {self.start.tolist()}, {self.end.tolist()} and {self.speed}"
            )

    @property
    def length(self) -> float:
        """Length of the way from start to end [m]."""
        return float(np.linalg.norm(self.end - self.start))

    def position(self, time: float) -> FloatArray:
        """Return where it is at a time [s], (3,) [m]."""
        travelled = (self.speed * time) % (2.0 * self.length)
        share = min(travelled, 2.0 * self.length - travelled) / self.length
        return (1.0 - share) * self.start + share * self.end

    def velocity(self, time: float) -> FloatArray:
        """Return how fast it moves at a time [s], (3,) [m/s]."""
        forth = (self.speed * time) % (2.0 * self.length) < self.length
        return (1.0 if forth else -1.0) * self.speed / self.length * (self.end - self.start)

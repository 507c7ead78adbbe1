"""A velocity trajectory, linear between knots: what the robot is sent, and where that leads."""

from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.core.library import functions
from handrail.controllers.errors import HandrailError

_ROUNDING = 1e-5  # of a time, relative: no later than the last knot


@dataclass(frozen=True)
class Trajectory:
    """Velocities that are linear between knots."""

    velocities: FloatArray  # at the knots, (k, n) with k ≥ 2 [m/s, rad/s]
    dt: float  # time between knots [s]
    elapsed: float = 0.0  # time that has passed since the first knot [s]

    def __post_init__(self) -> None:
        """Copy the array and make it read-only."""
        knots, dt = frozen(self.velocities), self.dt
        if knots.ndim != 2 or not len(knots) or not 0.0 < dt < np.inf:
            raise HandrailError(f"trajectory: expected velocities (k, n), dt > 0; got {knots.shape}, {dt}")
        object.__setattr__(self, "velocities", knots)

    def velocity(self, time: float) -> FloatArray:
        """Return the velocity `time` [s] from now, (n,); zero after the last knot."""
        knot, last = (max(time, 0.0) + self.elapsed) / self.dt, len(self.velocities) - 1
        if knot >= last:
            return np.zeros_like(self.velocities[0]) if self.is_over(time) else self.velocities[-1]
        index, weight = int(knot), knot - int(knot)
        return (1.0 - weight) * self.velocities[index] + weight * self.velocities[index + 1]

    def is_over(self, time: float) -> bool:
        """Whether the last knot lies in the past `time` [s] from now, by more than rounding."""
        last = len(self.velocities) - 1
        return (max(time, 0.0) + self.elapsed) / self.dt - last > _ROUNDING * last

    def after(self, time: float) -> "Trajectory":
        """Return what is left of it `time` [s] from now: the same curve, without knots long past."""
        passed = self.elapsed + max(time, 0.0)
        whole = int(min(passed / self.dt, len(self.velocities) - 2))
        return Trajectory(self.velocities[whole:], self.dt, passed - whole * self.dt)

    def accelerations(self, count: int, time: float = 0.0) -> FloatArray:
        """Return the mean accelerations over intervals dt, (count, n); zero after the end.

        Args:
            count: of intervals.
            time: when the first one begins, from now [s].
        """
        found, first = np.empty((count, self.velocities.shape[1])), (self.elapsed + max(time, 0.0)) / self.dt
        functions().mean_accelerations(self.velocities, *self.velocities.shape, first, self.dt, count, found)
        return found

    def path(self, q: FloatArray, samples: int = 1) -> tuple[FloatArray, FloatArray]:
        """Return where it leads from q: positions, (K, n), and their times from now, (K,) [s].

        Args:
            q: where it begins now, (n,).
            samples: in every interval between knots; the first is now.
        """
        step = self.dt / samples
        ahead = step * np.arange(samples * (len(self.velocities) - 1) + 1) - self.elapsed
        times = np.append(0.0, ahead[ahead > 0.0])
        knots = (times + self.elapsed) / self.dt
        velocities = np.empty((len(times), self.velocities.shape[1]))
        functions().interpolate(self.velocities, *self.velocities.shape, knots, len(knots), velocities)
        moves = 0.5 * np.diff(times)[:, None] * (velocities[:-1] + velocities[1:])
        return np.vstack([q, q + np.cumsum(moves, axis=0)]), times

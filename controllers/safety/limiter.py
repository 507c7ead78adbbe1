"""The last gate before the robot: every velocity command passes it."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.core.library import Pointer, functions
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.description import RobotDescription

_USUAL_STOP = 32  # knots for which there is room at once
_TOLERANCE = 1e-5  # relative; rounding to float32 is no violation


class Limiter:
    """Clips a velocity command to the limits of the robot.

    With the previous command v⁻ and the target v, over a step of h seconds:
    `v⁺ = clip(clip(v, ±v_max), v⁻ ± h a_max)`. With a position given, the velocity towards a position
    limit at distance d is also so low that the robot can stop before it, while the velocity goes linearly
    from v⁻ to v⁺: `h (v⁻ + v⁺) / 2 + v⁺² / (2 a_max) ≤ d`. Whole steps add h² a_max / 8 at most.

    Attributes:
        limits: of the robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        self.limits = limits = description.limits
        self._acceleration = Pointer(limits.acceleration)  # for the compiled core

    def limit(
        self, previous: FloatArray, target: FloatArray, duration: float, q: FloatArray | None = None
    ) -> tuple[FloatArray, bool]:
        """Return the velocity that may be commanded, (n,), and whether it differs from the target.

        A target of the wrong size, or a target or a position with a number that is not finite, brakes.

        Args:
            previous: the velocity commanded last, (n,) [m/s, rad/s].
            target: the velocity asked for, (n,).
            duration: of the step [s].
            q: the position, (n,) [m, rad]; None leaves position limits alone.
        """
        target = np.asarray(target, dtype=np.float64)
        known = q is None or bool(np.all(np.isfinite(q)))
        valid = known and target.shape == previous.shape and bool(np.all(np.isfinite(target)))
        wanted = target if valid else np.zeros_like(previous)
        maximum = self.limits.velocity
        allowed = _within(wanted, -maximum, maximum)
        if q is not None and known:
            allowed = _within(allowed, *self._braking_range(previous, duration, q))
        step = self.limits.acceleration * duration
        allowed = _within(allowed, previous - step, previous + step)
        tolerance = _TOLERANCE * (maximum + step)
        return allowed, not valid or bool(np.any(np.abs(allowed - wanted) > tolerance))

    def to_rest(self, velocities: FloatArray, dt: float) -> FloatArray:
        """Return velocities at knots, (k, n), and the fastest stop from the last one."""
        count, n = len(velocities), len(self.limits.velocity)
        last = np.array(velocities[-1], dtype=np.float64)
        if last.shape != (n,):
            raise HandrailError(f"velocity to stop from: expected {n} numbers, got shape {last.shape}")
        room, needed = -1, _USUAL_STOP
        while needed > room:
            room, result = needed, np.empty((count + needed, n))
            needed = functions().stop_velocities(last, n, self._acceleration, dt, room, result[count:])
        if needed < 0:
            raise HandrailError(f"velocity to stop from: expected finite numbers, got {last.tolist()}")
        result[:count] = velocities
        return result[: count + needed]

    def _braking_range(
        self, previous: FloatArray, duration: float, q: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        half, acceleration, travelled = 0.5 * duration, self.limits.acceleration, 0.5 * duration * previous
        above = np.maximum(self.limits.position_upper - q - travelled, 0.0) / acceleration
        below = np.maximum(q + travelled - self.limits.position_lower, 0.0) / acceleration
        fastest = [acceleration * (np.sqrt(half**2 + 2.0 * room) - half) for room in (below, above)]
        return -fastest[0], fastest[1]


def _within(values: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Return `min(max(v, lower), upper)`; NumPy's clip takes twice as long for so few."""
    return np.minimum(np.maximum(values, lower), upper)

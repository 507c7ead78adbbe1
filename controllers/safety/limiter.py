"""The last gate before the robot: every velocity command passes it."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.jit import exact_jit, jit
from handrail.controllers.robot.description import RobotDescription

_TOLERANCE = 1e-5  # relative; rounding to float32 is no violation


class Limiter:
    """Clips a velocity command to the limits of the robot.

    With the previous command v⁻ and the target v, over a step of h seconds:
    `v⁺ = clip(clip(v, ±v_max), v⁻ ± h a_max)`. With a position given, the velocity towards a position
    limit is also kept below what can brake before it, `sqrt(2 a_max distance)`.

    Attributes:
        limits: of the robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        self.limits = description.limits

    def limit(
        self, previous: FloatArray, target: FloatArray, duration: float, q: FloatArray | None = None
    ) -> tuple[FloatArray, bool]:
        """Return the velocity that may be commanded, (n,), and whether it differs from the target.

        A target of the wrong size, or with a number that is not finite, brakes.

        Args:
            previous: the velocity commanded last, (n,) [m/s, rad/s].
            target: the velocity asked for, (n,).
            duration: of the step [s].
            q: the position, (n,) [m, rad]; None leaves position limits alone.
        """
        target = np.asarray(target, dtype=np.float64)
        valid = target.shape == previous.shape and bool(np.all(np.isfinite(target)))
        wanted = target if valid else np.zeros_like(previous)
        maximum = self.limits.velocity
        allowed = np.clip(wanted, -maximum, maximum)
        if q is not None:
            allowed = np.clip(allowed, *self._braking_range(q))
        step = self.limits.acceleration * duration
        allowed = np.clip(allowed, previous - step, previous + step)
        tolerance = _TOLERANCE * (maximum + step)
        return allowed, not valid or bool(np.any(np.abs(allowed - wanted) > tolerance))

    def to_rest(self, velocities: FloatArray, dt: float) -> FloatArray:
        """Return velocities at knots, (k, n), and the fastest stop from the last one."""
        return _to_rest(velocities, dt, self.limits.acceleration)

    def stop(self, q: FloatArray, v: FloatArray, shares: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return configurations along the fastest stop, (K, n), and their times, (K,) [s].

        Args:
            q: where it begins, (n,).
            v: how fast, (n,).
            shares: of the time until every joint rests, (K,).
        """
        return _stop(q, v, self.limits.acceleration, shares)

    def _braking_range(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        above = np.maximum(self.limits.position_upper - q, 0.0)
        below = np.maximum(q - self.limits.position_lower, 0.0)
        twice = 2.0 * self.limits.acceleration
        return -np.sqrt(twice * below), np.sqrt(twice * above)


@exact_jit
def _to_rest(velocities, dt, deceleration):
    count, n = velocities.shape
    longest = 0.0
    for j in range(n):
        longest = max(longest, abs(velocities[-1, j]) / deceleration[j])
    steps = max(1, int(np.ceil(longest / dt)))
    result = np.empty((count + steps, n))
    for k in range(count):
        for j in range(n):
            result[k, j] = velocities[k, j]
    for k in range(steps):
        for j in range(n):
            last = velocities[-1, j]
            result[count + k, j] = np.sign(last) * max(abs(last) - deceleration[j] * (dt * (k + 1)), 0.0)
    return result


@jit
def _stop(q, v, deceleration, shares):
    longest = 0.0
    for j in range(len(v)):
        longest = max(longest, abs(v[j]) / deceleration[j])
    path, times = np.empty((len(shares), len(q))), np.empty(len(shares))
    for k in range(len(shares)):
        times[k] = shares[k] * longest
        for j in range(len(v)):
            moving = min(times[k], abs(v[j]) / deceleration[j])
            path[k, j] = q[j] + v[j] * moving - 0.5 * np.sign(v[j]) * deceleration[j] * moving**2
    return path, times

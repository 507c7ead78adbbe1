"""Arithmetic of motions under accelerations held over stages, in machine code."""

import numpy as np

from handrail.controllers.numerics.jit import exact_jit, jit


@jit
def rollout(q, v, dt, u, positions, velocities):
    """Write positions and velocities, (N + 1, n), from (q, v) under accelerations u, (N, n)."""
    horizon, n = u.shape
    for j in range(n):
        positions[0, j] = q[j]
        velocities[0, j] = v[j]
    for k in range(horizon):
        for j in range(n):
            after = velocities[k, j] + dt * u[k, j]
            velocities[k + 1, j] = after
            positions[k + 1, j] = positions[k, j] + 0.5 * dt * (velocities[k, j] + after)


@exact_jit
def approach(velocities, step):
    """Keep velocities, (K, n), within ± a step, (n,), of those before; the first stays."""
    for k in range(1, len(velocities)):
        for j in range(velocities.shape[1]):
            before = velocities[k - 1, j]
            velocities[k, j] = min(max(velocities[k, j], before - step[j]), before + step[j])


@jit
def cumulated(velocities, dt):
    """Return how far velocities at knots, (K, n), have led at each of them, (K, n)."""
    way = np.zeros(velocities.shape)
    for k in range(1, len(velocities)):
        for j in range(velocities.shape[1]):
            way[k, j] = way[k - 1, j] + 0.5 * dt * (velocities[k - 1, j] + velocities[k, j])
    return way


@jit
def is_motion(q, v, dt, u, positions, velocities, limit, tolerance):
    """Whether accelerations u, (N, n), are finite, within ± limit, and lead from (q, v) where it is said."""
    horizon, n = u.shape
    for j in range(n):
        position, velocity = q[j], v[j]
        bound = limit[j] * (1.0 + tolerance) + tolerance
        for k in range(horizon + 1):
            near = (
                abs(positions[k, j] - position) <= tolerance and abs(velocities[k, j] - velocity) <= tolerance
            )
            if not near:
                return False
            if k < horizon:
                if not abs(u[k, j]) <= bound:
                    return False
                after = velocity + dt * u[k, j]
                position += 0.5 * dt * (velocity + after)
                velocity = after
    return True


@jit
def clipped_sum(first, second, limit, out):
    """Write the sum of two arrays, (N, n), within ± limit, (n,)."""
    for k in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[k, j] = min(max(first[k, j] + second[k, j], -limit[j]), limit[j])


@jit
def changed(q, v, dt, u, change, limit):
    """Return positions and velocities, (N + 1, n), under changed accelerations, and these, within ± limit."""
    horizon, n = u.shape
    positions, velocities = np.empty((horizon + 1, n)), np.empty((horizon + 1, n))
    within = np.empty((horizon, n))
    clipped_sum(u, change, limit, within)
    rollout(q, v, dt, within, positions, velocities)
    return positions, velocities, within


@exact_jit
def resumed(commanded, measured, tolerance, limit):
    """Return the velocity from which a command goes on, (n,).

    `min(max(c, v - tolerance), v + tolerance)`, but between rest and c. A robot that cannot follow is waited
    for, the tolerance ahead of it; one that is pushed onward keeps what was commanded; one pushed back is
    asked to rest. So its servos hold against a push.

    Args:
        commanded: c, (n,) [m/s, rad/s].
        measured: v, (n,).
        tolerance: how far they may differ, (n,).
        limit: of the velocity, (n,).
    """
    velocity = np.empty(len(measured))
    for j in range(len(measured)):
        close = min(max(commanded[j], measured[j] - tolerance[j]), measured[j] + tolerance[j])
        between = min(max(close, min(commanded[j], 0.0)), max(commanded[j], 0.0))
        velocity[j] = min(max(between, -limit[j]), limit[j])
    return velocity


@jit
def cut(values, mask, limit, out):
    """Write values, (N, m), within ± limit, (m,), to the first columns of an array; 0 where mask is false."""
    for k in range(values.shape[0]):
        for j in range(values.shape[1]):
            out[k, j] = min(max(values[k, j], -limit[j]), limit[j]) if mask[j] else 0.0


@jit
def largest_share(change, limit):
    """Return the largest absolute entry of an array, (N, n), relative to a limit, (n,)."""
    worst = 0.0
    for k in range(change.shape[0]):
        for j in range(change.shape[1]):
            worst = max(worst, abs(change[k, j]) / limit[j])
    return worst

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
def within(values, limit):
    """Whether all values, (K, n), are within ± limit, (n,); those that are no numbers are not."""
    inside = True
    for k in range(len(values)):
        for j in range(values.shape[1]):
            inside &= abs(values[k, j]) <= limit[j]
    return inside


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
def changed(q, v, dt, u, change, limit):
    """Return positions and velocities, (N + 1, n), under changed accelerations, and these, within ± limit."""
    horizon, n = u.shape
    positions, velocities = np.empty((horizon + 1, n)), np.empty((horizon + 1, n))
    within = np.empty((horizon, n))
    for k in range(horizon):
        for j in range(n):
            within[k, j] = min(max(u[k, j] + change[k, j], -limit[j]), limit[j])
    rollout(q, v, dt, within, positions, velocities)
    return positions, velocities, within

"""Arithmetic of motions under accelerations held over stages, in machine code."""

from handrail.controllers.jit import jit


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
def cut(values, limit, out):
    """Write values, (N, m), within ± limit, (m,), to the first columns of an array."""
    for k in range(values.shape[0]):
        for j in range(values.shape[1]):
            out[k, j] = min(max(values[k, j], -limit[j]), limit[j])


@jit
def largest_share(change, limit):
    """Return the largest absolute entry of an array, (N, n), relative to a limit, (n,)."""
    worst = 0.0
    for k in range(change.shape[0]):
        for j in range(change.shape[1]):
            worst = max(worst, abs(change[k, j]) / limit[j])
    return worst

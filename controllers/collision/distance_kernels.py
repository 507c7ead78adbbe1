"""What a pair's nearest points say: its distance and gradient.

A witness is `(n, p₁, p₂)`, (9,): the unit normal from the first shape to the second and their nearest points.
"""

import numpy as np

from handrail.controllers.numerics.jit import copy, exact_jit, jit


@jit
def signed(witness):
    """Return `n·(p₂ - p₁)` [m]."""
    total = 0.0
    for axis in range(3):
        total += witness[axis] * (witness[6 + axis] - witness[3 + axis])
    return total


@jit
def lower_bounds(now, start, path, times, motion_bounds, speeds, within):
    """Return how near each pair can be along a path, (K, P) [m], and whether it can come below its limit.

    `d_p(q_k) ≥ d_p(q) - Σ_j L_jp |q_k - q|_j - |v_p| t_k`.

    Args:
        now: distances at the start, (P,) [m].
        start: q, (n,).
        path: configurations, (K, n).
        times: of them [s], (K,).
        motion_bounds: L, (n, P).
        speeds: of moving obstacles, (P,) [m/s].
        within: that limit, (P,) [m].
    """
    pairs = len(now)
    bounds = np.empty((len(path), pairs))
    close = np.zeros(pairs, dtype=np.bool_)
    for k in range(len(path)):
        for p in range(pairs):
            bounds[k, p] = now[p] - speeds[p] * times[k]
        for j in range(path.shape[1]):
            moved = abs(path[k, j] - start[j])
            if moved > 0.0:
                for p in range(pairs):
                    bounds[k, p] -= motion_bounds[j, p] * moved
        for p in range(pairs):
            if bounds[k, p] < within[p]:
                close[p] = True
    return bounds, close


@jit
def raise_bounds(bounds, path, known, there, motion_bounds, within):
    """Raise lower bounds by those of another path among the same obstacles; return which are close.

    `d_p(q_k) ≥ d_p(q'_k) - Σ_j L_jp |q_k - q'_k|_j`.

    Args:
        bounds: along a path, (K, P) [m].
        path: configurations q, (K, n).
        known: distances along another path, or lower bounds of them, (K, P) [m].
        there: its configurations q', (K, n).
        motion_bounds: L, (n, P).
        within: below which a pair is close, (P,) [m].
    """
    pairs = bounds.shape[1]
    close, other = np.zeros(pairs, dtype=np.bool_), np.empty(pairs)
    for k in range(len(path)):
        copy(known[k], pairs, other)
        for j in range(path.shape[1]):
            moved = abs(path[k, j] - there[k, j])
            for p in range(pairs):
                other[p] -= motion_bounds[j, p] * moved
        for p in range(pairs):
            bounds[k, p] = max(bounds[k, p], other[p])
            if bounds[k, p] < within[p]:
                close[p] = True
    return close


@jit
def take(found, pairs, node, witnesses, values):
    """Keep what coal found for some pairs at a node: witnesses, (K, P, 9), and distances, (K, P).

    Args:
        found: witnesses of all pairs, (P, 9).
        pairs: indices of those that were measured.
        node: k.
        witnesses: of all nodes.
        values: of all nodes [m].
    """
    for p in pairs:
        copy(found[p], 9, witnesses[node, p])
        values[node, p] = signed(witnesses[node, p])


@jit
def depth(values):
    """Return by how much pairs overlap at any node that do not at the first, or not as much, (K, P) [m]."""
    deepest = 0.0
    for k in range(len(values)):
        for p in range(values.shape[1]):
            deepest = max(deepest, min(values[0, p], 0.0) - values[k, p])
    return deepest


@exact_jit
def smallest(distances, apart):
    """Return the smallest of the distances, (P,), those apart left out, and the smallest of those [m]."""
    others, theirs = np.inf, np.inf
    for p in range(len(distances)):
        if apart[p]:
            theirs = min(theirs, distances[p])
        else:
            others = min(others, distances[p])
    return others, theirs


@jit
def gradients(witnesses, jacobians, moves, values, within):
    """Return the entries (node, pair) below their limit, (R, 2), and their gradients, (R, n).

    `∂d/∂q = n·(J(p₂) - J(p₁))` with `J(p) = J_v + J_ω × p` of the joints that move the shape.

    Args:
        witnesses: (K, P, 9).
        jacobians: spatial, in the world, (K, 6, n).
        moves: which joints move the two shapes of a pair: 1 or 0, (P, 2, n).
        values: distances, (K, P) [m].
        within: that limit, (P,) [m].
    """
    count = 0
    for k in range(values.shape[0]):
        for p in range(values.shape[1]):
            count += values[k, p] < within[p]
    near = np.empty((count, 2), dtype=np.int64)
    rows = np.zeros((count, moves.shape[2]))
    row = 0
    for k in range(values.shape[0]):
        for p in range(values.shape[1]):
            if values[k, p] < within[p]:
                near[row, 0], near[row, 1] = k, p
                _add_gradient(witnesses[k, p], 3, jacobians[k], moves[p, 0], -1.0, rows[row])
                _add_gradient(witnesses[k, p], 6, jacobians[k], moves[p, 1], 1.0, rows[row])
                row += 1
    return near, rows


@jit
def _add_gradient(witness, start, jacobian, moves, sign, out):
    """Add the sign times the derivative of `n·p` for the nearest point that begins at `start`."""
    nx, ny, nz = witness[0], witness[1], witness[2]
    px, py, pz = witness[start], witness[start + 1], witness[start + 2]
    mx, my, mz = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
    for j in range(len(out)):
        if moves[j] > 0.0:
            linear = nx * jacobian[0, j] + ny * jacobian[1, j] + nz * jacobian[2, j]
            angular = mx * jacobian[3, j] + my * jacobian[4, j] + mz * jacobian[5, j]
            out[j] += sign * (linear + angular)

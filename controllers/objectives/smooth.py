"""Smooth stand-ins for kinked functions, so that every residual has derivatives everywhere."""

import casadi as ca


def hinge(x: ca.SX, width: float) -> ca.SX:
    """Return a smooth `max(x, 0)`: `½ (x + √(x² + width²)) `, off by at most width / 2, at x = 0."""
    return 0.5 * (x + ca.sqrt(x * x + width * width))


def norm(vector: ca.SX, width: float) -> ca.SX:
    """Return a smooth length `√(‖vector‖² + width²)`."""
    return ca.sqrt(ca.dot(vector, vector) + width * width)


def bounded_pull(error: ca.SX, scale: float) -> ca.SX:
    """Return e scaled to `‖r‖² = 2 δ² (√(1 + ‖e‖²/δ²) - 1)`, the pseudo-Huber loss, δ = scale.

    Near the goal r = e; far from it the cost grows linearly, so that its pull, at most weight times δ,
    cannot outweigh the tracking of a command.
    """
    root = ca.sqrt(1.0 + ca.dot(error, error) / scale**2)
    return error * ca.sqrt(2.0 / (root + 1.0))

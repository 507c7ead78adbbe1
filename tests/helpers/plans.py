"""Whether a plan is one, and what is said of a solution of its QP."""

import numpy as np

_TOLERANCE = 1e-6


def is_solution(plan, problem):
    """Return whether a plan is finite, obeys the dynamics from the state and the hard acceleration limits."""
    bound = problem.limits.acceleration * (1.0 + _TOLERANCE) + _TOLERANCE
    if not (plan.solved and np.all(np.abs(plan.u) <= bound)):
        return False
    pairs = zip((plan.q, plan.v), problem.rollout(plan.u), strict=True)
    return all(bool(np.all(np.abs(one - other) <= _TOLERANCE)) for one, other in pairs)


def cost(qp, x):
    """Return the objective of a dense program at x, (m,)."""
    return float(0.5 * x @ qp.hessian @ x + qp.gradient @ x)


def violation(qp, x):
    """Return by how much the row of a dense program that is broken most is."""
    return float(np.max(qp.matrix @ x - qp.upper))

"""What a plan costs, exactly: residuals, distances and limits at the plan itself, nothing linearised."""

from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.slacks import LIMITS, VELOCITY_SLACK
from handrail.controllers.ocp.nodes import Nodes
from handrail.controllers.ocp.problem import Problem
from handrail.controllers.ocp.residuals import StageResiduals
from handrail.controllers.solvers.distance_limits import RECOVERY


@dataclass(frozen=True)
class Evaluation:
    """A plan's cost and its parts.

    Attributes:
        tracking: weighted squared errors of all objectives.
        collision_slack: largest violation of a distance against its bound [m].
        limit_slack: that the velocity and position limits need, relative.
        cost: all of it, with the penalties of the slacks.
    """

    tracking: float
    collision_slack: float
    limit_slack: float
    cost: float


class Evaluator:
    """Evaluates `Σ ½ ‖r - ref‖²_W + Σ_i (ρ₁ σ_i + ½ ρ₂ σ_i²)` at accelerations, σ the least that do."""

    def __init__(self, residuals: StageResiduals, horizon: int) -> None:
        self._residual = residuals.expression.map(horizon)

    def __call__(self, problem: Problem, u: FloatArray) -> Evaluation:
        """Return what accelerations (N, n) cost."""
        q, v = problem.rollout(u)
        error = self.residuals(problem, u) - problem.reference
        tracking = 0.5 * float(np.sum(problem.weights * error**2))
        distances, limits = distance_slacks(problem, q, v), limit_slack(problem, q, v)
        slacks = np.append(distances, limits)
        penalty = problem.slack_linear * slacks.sum() + 0.5 * problem.slack_quadratic * slacks @ slacks
        return Evaluation(tracking, float(distances.max()), limits, tracking + float(penalty))

    def residuals(self, problem: Problem, u: FloatArray) -> FloatArray:
        """Return every residual of every stage, (N, r)."""
        q, v = problem.rollout(u)
        z = np.hstack([q[1:], v[1:], u])
        parameters = np.tile(problem.parameters, (problem.horizon, 1))
        return np.array(self._residual(z.T, parameters.T)).T

    def tracking_error(self, problem: Problem, u: FloatArray) -> float:
        """Return the norm of the commanded channels' error at the last tracked stage."""
        weights = problem.weights[:, : problem.channels]
        tracked = np.flatnonzero(weights.any(axis=1))
        if not len(tracked):
            return 0.0
        error = (self.residuals(problem, u) - problem.reference)[tracked[-1], : problem.channels]
        return float(np.linalg.norm(error[weights[tracked[-1]] > 0]))


def distance_bounds(problem: Problem, now: FloatArray, count: int) -> FloatArray:
    """Return what every pair must keep at the nodes from now on, given its distance now, (K, P) [m].

    `margin - max(margin - d_now, 0) 0.8ᵏ`: a pair inside its margin recovers gradually.
    """
    deficit = np.maximum(problem.margins - now, 0.0)
    return problem.margins - deficit * RECOVERY ** np.arange(count)[:, None]


def distance_slacks(problem: Problem, q: FloatArray, v: FloatArray) -> FloatArray:
    """Return the largest violation of a distance of each kind at the nodes after now, (3,) [m]."""
    nodes = Nodes(problem, q, v)
    values = problem.collision.values(nodes.q, nodes.times)
    short = (distance_bounds(problem, values[0], len(values)) - values)[1:]
    kinds = problem.collision.kinds
    return np.array([np.max(short[:, kinds == kind], initial=0.0) for kind in range(LIMITS)])


def limit_slack(problem: Problem, q: FloatArray, v: FloatArray) -> float:
    """Return the slack that the position and velocity limits after now need, relative to half the range."""
    limits = problem.limits
    middle = 0.5 * (limits.position_upper + limits.position_lower)
    half = 0.5 * (limits.position_upper - limits.position_lower)
    position = float(np.abs((q[1:] - middle) / half).max()) - 1.0
    velocity = float(np.abs(v[1:] / limits.velocity).max()) - 1.0
    return max(position, velocity / VELOCITY_SLACK, 0.0)

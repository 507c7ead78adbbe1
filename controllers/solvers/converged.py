"""The converged solver: IPOPT on the very problem that the real-time solver takes one step on.

Cost, dynamics and limits are exact. Distances are linearised around the last iterate and the program is
solved again, in a trust region that grows and shrinks with how well the exact cost follows, until the
program promises nothing more. Nothing in it is meant to be fast.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray, frozen
from handrail.controllers.collision.slacks import LIMITS, SLACKS
from handrail.controllers.core.library import constant
from handrail.controllers.errors import HandrailError, message_of
from handrail.controllers.interrupts import interrupted
from handrail.controllers.ocp.motion import Nodes, nodes_of
from handrail.controllers.ocp.problem import RECOVERY, Plan, Problem
from handrail.controllers.ocp.residuals import StageResiduals

VELOCITY_SLACK = constant("VELOCITY_SLACK")
_ROUNDS = 50  # of linearising the distances, at most
_TOLERANCE = 1e-5  # promised improvement of the cost, relative, at which it stops
_NOISE = 1e-9  # of the cost: what the inner solver leaves
_LARGEST_TRUST = 2.0  # of the acceleration limit: no restriction
_SMALLEST_TRUST = 1e-4
_ENOUGH = 0.75  # of the promised improvement
_CORRECTIONS = 2  # of second order, at most, in a step
_BLOCK = 64  # the distance rows are a multiple of this, so that few programs have to be built
_OPTIONS = {
    "print_time": False,
    "record_time": False,
    "error_on_fail": False,
    "expand": True,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "tol": 1e-7,
        "bound_relax_factor": 0.0,
        "nlp_scaling_method": "none",  # the penalties would scale the cost, and its tolerance, by 1e-3
        "mu_strategy": "adaptive",  # the fastest here
    },
}


class Evaluation(NamedTuple):
    """The exact cost of a motion, nothing linearised."""

    tracking: float  # weighted squared errors of all objectives
    slack: FloatArray  # the least σ that do, (4,)
    cost: float  # all of it, with the penalties of the slacks


@dataclass(frozen=True)
class _Iterate:
    """Accelerations, what they cost, and rows `A (s, σ) ≤ b` of the near pairs around them."""

    u: FloatArray  # accelerations, (N, n)
    exact: Evaluation  # what they cost
    matrix: FloatArray  # A; rows of zeros fill up, (R, N n + 4)
    left: FloatArray  # b, (R,)
    near: IntArray  # (node, pair) of the rows that do not only fill up, (r, 2)


class _Solution(NamedTuple):
    """A change of s, (N n,), what it promises to cost, and whether IPOPT converged."""

    change: FloatArray
    u: FloatArray
    cost: float
    solved: bool


class ConvergedSolver:
    """Minimises `Problem` to convergence.

    Args:
        residuals: of one stage.
        horizon: stages N.
        size: coordinates n.
        dt: length of a stage [s].
    """

    def __init__(self, residuals: StageResiduals, horizon: int, size: int, dt: float) -> None:
        self._residuals = residuals.expression.map(horizon)
        self._matrix = stage_matrix(dt)
        self._program = lru_cache(lambda rows: _program(self._residuals, (horizon, size), self._matrix, rows))

    def solve(self, problem: Problem, guess: FloatArray) -> Plan:
        """Return the minimum near the accelerations `guess`, (N, n); `solved` says whether it is one."""
        limit = problem.limits.acceleration
        here = self._iterate(problem, guess)
        share, done = _LARGEST_TRUST, False
        for _ in range(_ROUNDS):
            solution, after = self._step(problem, here, share * limit)
            if not solution.solved:
                break
            cost = here.exact.cost
            promised, change = cost - solution.cost, float(np.abs((after.u - here.u) / limit).max())
            exact = not len(here.near) and not len(after.near)  # nothing was linearised
            share = _next_trust(share, change, (cost - after.exact.cost) / max(promised, 1e-12))
            if after.exact.cost <= cost * (1.0 + _NOISE) + _NOISE:
                here = after
            done = exact or promised <= _TOLERANCE * (1.0 + here.exact.cost) or share <= _SMALLEST_TRUST
            if done:
                break
        q, v = problem.rollout(here.u)
        return Plan(
            q=frozen(q),
            v=frozen(v),
            u=frozen(here.u),
            collision_slack=float(here.exact.slack[:LIMITS].max()),
            limit_slack=float(here.exact.slack[LIMITS]),
            distances=frozen(problem.collision.values(problem.q[None])[0]),
            solved=done,
            rows=len(here.near),
        )

    def evaluate(self, problem: Problem, u: FloatArray) -> Evaluation:
        """Return `Σ ½ ‖r - ref‖²_W + Σ_i (ρ₁ σ_i + ½ ρ₂ σ_i²)` at accelerations (N, n)."""
        q, v = problem.rollout(u)
        z, parameters = np.hstack([q[1:], v[1:], u]), np.tile(problem.parameters, (problem.horizon, 1))
        error = np.array(self._residuals(z.T, parameters.T)).T - problem.reference
        tracking = 0.5 * float(np.sum(problem.weights * error**2))
        nodes = _nodes(problem, q, v)
        left, kinds = _distances_left(problem, nodes), problem.collision.kinds
        distances = [np.max(-left[1:, kinds == kind], initial=0.0) for kind in range(LIMITS)]
        slack = np.append(distances, _limit_slack(problem, q, v))
        penalty = problem.slack_linear * slack.sum() + 0.5 * problem.slack_quadratic * slack @ slack
        return Evaluation(tracking, slack, tracking + float(penalty))

    def _iterate(self, problem: Problem, u: FloatArray) -> _Iterate:
        u = np.clip(u, -problem.limits.acceleration, problem.limits.acceleration)
        q, v = problem.rollout(u)
        nodes = _nodes(problem, q, v)
        within = problem.margins + problem.activation_distance
        found = problem.collision.distances(nodes.q, within, nodes.times)
        node, pair = near = found.near[found.near[:, 0] > 0].T
        matrix = np.zeros((_BLOCK * -(-len(node) // _BLOCK), u.size + SLACKS))
        left = np.ones(len(matrix))
        left[: len(node)] = _distances_left(problem, nodes, found.values)[node, pair]
        gradients = found.gradients[found.near[:, 0] > 0]
        self._write_rows(problem, nodes, near, gradients, matrix)
        return _Iterate(u, self.evaluate(problem, u), matrix, left, near.T)

    def _write_rows(
        self, problem: Problem, nodes: Nodes, near: IntArray, gradients: FloatArray, matrix: FloatArray
    ) -> None:
        """Write `-d'` of the near pairs at their nodes, by changes s, and -1 for the slack of their kind."""
        horizon, n = problem.horizon, len(problem.q)
        for row, ((node, pair), gradient) in enumerate(zip(near.T, gradients, strict=True)):
            stage, stop = min(node, horizon) - 1, node - horizon - 1
            by_velocity = nodes.gains[stop] * gradient if stop >= 0 else np.zeros(n)
            parts = self._matrix[0][:, None] * gradient + self._matrix[1][:, None] * by_velocity  # (3, n)
            for share, before in zip(parts, range(stage - 2, stage + 1), strict=True):
                if before >= 0:
                    matrix[row, before * n : (before + 1) * n] = -share
            matrix[row, horizon * n + problem.collision.kinds[pair]] = -1.0

    def _step(self, problem: Problem, here: _Iterate, trust: FloatArray) -> tuple[_Solution, _Iterate]:
        """Return the program's solution, and the best iterate found with it.

        Where the distances curve, the exact cost at the solution is much higher than promised: the rows are
        then made exact there, gradients kept, and the program is solved again (a second-order correction).
        """
        first = solution = self._solved(problem, here, here.left, trust)
        best = after = self._iterate(problem, first.u)
        for _ in range(_CORRECTIONS if len(here.near) else 0):
            cost = here.exact.cost
            if cost - best.exact.cost >= _ENOUGH * (cost - first.cost) or not solution.solved:
                break
            node, pair = here.near.T
            left, change = here.left.copy(), here.matrix[:, :-SLACKS] @ solution.change
            exact = _distances_left(problem, _nodes(problem, *problem.rollout(after.u)))
            left[: len(node)] = exact[node, pair] + change[: len(node)]
            solution = self._solved(problem, here, left, trust)
            after = self._iterate(problem, solution.u)
            best = after if after.exact.cost < best.exact.cost else best
        return first, best

    def _solved(self, problem: Problem, here: _Iterate, left: FloatArray, trust: FloatArray) -> _Solution:
        """Return the minimum within a trust region, (n,), where so much is left of the distances, (R,)."""
        limits, u = problem.limits, here.u
        q, v = problem.rollout(u)
        half = 0.5 * (limits.position_upper - limits.position_lower)
        shift = np.hstack([problem.range_shift, np.zeros_like(u)])
        upper = (np.append(limits.position_upper, limits.velocity) + shift).ravel()
        lower = (np.append(limits.position_lower, -limits.velocity) + shift).ravel()
        least, most = np.maximum(-limits.acceleration, u - trust), np.minimum(limits.acceleration, u + trust)
        free = np.full(len(upper), np.inf)
        guess = here.exact.slack + 1e-3  # a little inside of the bounds
        solver = self._program(len(left))
        given = (np.hstack([q[1:], v[1:], u]), problem.reference, problem.weights, here.matrix)
        try:
            found = solver(
                x0=np.append(np.zeros(u.size), guess),
                lbx=np.append(np.full(u.size, -np.inf), np.zeros(SLACKS)),
                lbg=np.concatenate([-free, lower, least.ravel(), np.full(len(left), -np.inf)]),
                ubg=np.concatenate([upper, free, most.ravel(), left]),
                p=np.concatenate(
                    [
                        *(np.ravel(values) for values in given),
                        problem.parameters,
                        *(half, VELOCITY_SLACK * limits.velocity),
                        [problem.slack_linear, problem.slack_quadratic],
                    ]
                ),
            )
        except RuntimeError as error:
            if interrupted():  # CasADi may say so itself
                raise KeyboardInterrupt from error
            raise HandrailError(f"converged solver: CasADi failed: {message_of(error)}") from error
        if interrupted():  # or only warns of it
            raise KeyboardInterrupt
        change, stats = np.array(found["x"]).ravel()[: u.size], solver.stats()
        moved = np.array(found["g"]).ravel()[2 * len(upper) :][: u.size].reshape(u.shape)
        return _Solution(change, moved, float(found["f"]), bool(stats["success"]))


def _program(residuals: Any, shape: tuple[int, int], matrix: FloatArray, rows: int) -> ca.Function:
    """Return the program in changes s of local support (core/motion.c) and the slacks σ.

    Its constraints: positions and velocities less their slack, and with it; accelerations; distances.
    """
    horizon, size = shape
    s, slack = ca.MX.sym("s", size, horizon), ca.MX.sym("slack", SLACKS)
    guess = ca.MX.sym("guess", 3 * size, horizon)
    reference, weights = (
        ca.MX.sym(name, residuals.size1_out(0), horizon) for name in ("reference", "weights")
    )
    near = ca.MX.sym("near", size * horizon + SLACKS, rows)  # row by row
    parameters, give = ca.MX.sym("parameters", residuals.size1_in(1)), ca.MX.sym("give", 2 * size)
    penalties = ca.MX.sym("penalties", 2)
    before = ca.horzcat(ca.MX.zeros(size, 2), s)
    parts = (sum(row[a] * before[:, a : a + horizon] for a in range(3)) for row in matrix)
    z = guess + ca.vertcat(*parts)
    error = residuals(z, ca.repmat(parameters, 1, horizon)) - reference
    cost = 0.5 * ca.dot(weights, error * error)
    cost += penalties[0] * ca.sum1(slack) + 0.5 * penalties[1] * ca.sumsqr(slack)
    soft, yields = z[: 2 * size, :], ca.repmat(give * slack[LIMITS], 1, horizon)
    limits = ca.veccat(soft - yields, soft + yields, z[2 * size :, :])
    x = ca.veccat(s, slack)
    given = ca.veccat(guess, reference, weights, near, parameters, give, penalties)
    program = {"x": x, "f": cost, "g": ca.vertcat(limits, near.T @ x), "p": given}
    return ca.nlpsol("program", "ipopt", program, _OPTIONS)


def stage_matrix(dt: float) -> FloatArray:
    """Return how (q, v, u) of a stage depend on (s_{k-2}, s_{k-1}, s_k) of core/motion.c, (3, 3)."""
    half = 0.5 * dt * dt
    return np.array([[0.0, half, half], [0.0, -dt, dt], [1.0, -2.0, 1.0]])


def _nodes(problem: Problem, q: FloatArray, v: FloatArray) -> Nodes:
    return nodes_of(q, v, problem.limits.acceleration, problem.dt)


def _distances_left(problem: Problem, nodes: Nodes, values: FloatArray | None = None) -> FloatArray:
    """Return by how much every pair is farther away than it must be at the nodes from now on, (K, P) [m].

    It must be `margin - max(margin - d_now, 0) 0.8ᵏ` away: a pair inside its margin recovers gradually.
    """
    if values is None:
        values = problem.collision.values(nodes.q, nodes.times)
    deficit = np.maximum(problem.margins - values[0], 0.0)
    return values - problem.margins + deficit * RECOVERY ** np.arange(len(values))[:, None]


def _limit_slack(problem: Problem, q: FloatArray, v: FloatArray) -> float:
    """Return the slack that the position and velocity limits after now need, relative to half the range."""
    limits, place = problem.limits, q[1:] - problem.range_shift
    half = 0.5 * (limits.position_upper - limits.position_lower)
    position = float((np.abs(place - limits.position_lower - half) / half).max()) - 1.0
    velocity = float(np.abs(v[1:] / limits.velocity).max()) - 1.0
    return max(position, velocity / VELOCITY_SLACK, 0.0)


def _next_trust(share: float, change: float, kept: float) -> float:
    """Return the next trust region, given which share of the promised improvement was kept."""
    if kept < 0.25:
        return 0.25 * min(share, change)
    return min(2.0 * share, _LARGEST_TRUST) if kept > _ENOUGH else share

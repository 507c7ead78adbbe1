"""The converged solver: IPOPT on the very problem that the real-time solver takes one step on."""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.ocp.problem import Plan, Problem
from handrail.controllers.ocp.residuals import StageResiduals
from handrail.controllers.solvers.reference.evaluation import Evaluator
from handrail.controllers.solvers.reference.linear_distances import LinearDistances, linear_distances
from handrail.controllers.solvers.reference.multistage import STOPS, MultistageProgram, Solution

_LARGEST_TRUST = 2.0  # of the acceleration limit: no restriction
_SMALLEST_TRUST = 1e-4
_NOISE = 1e-9  # of the cost: what the inner solver leaves
_ENOUGH = 0.75  # of the promised improvement
_CORRECTIONS = 2  # of second order, at most, in a step


@dataclass(frozen=True)
class _Iterate:
    """Accelerations, their exact cost, and the distances around them."""

    u: FloatArray
    cost: float
    distances: LinearDistances


class ConvergedSolver:
    """Minimises `Problem` to convergence; nothing in it is meant to be fast.

    Cost, dynamics and limits are exact. Distances are linearised around the last iterate and the program is
    solved again, in a trust region that grows and shrinks with how well the exact cost follows, until the
    program promises nothing more.

    Args:
        residuals: of one stage.
        horizon: stages N.
        size: coordinates n.
        dt: length of a stage [s].
        tolerance: promised improvement of the cost, relative, at which it stops.
        rounds: of linearising the distances, at most.
    """

    def __init__(
        self,
        residuals: StageResiduals,
        horizon: int,
        size: int,
        dt: float,
        tolerance: float = 1e-5,
        rounds: int = 50,
    ) -> None:
        self._arguments = (residuals, horizon, size, dt)
        self._tolerance = tolerance
        self._rounds = rounds
        self._programs: dict[int, MultistageProgram] = {}
        self._evaluate = Evaluator(residuals, horizon)

    def solve(self, problem: Problem, guess: FloatArray) -> Plan:
        """Return the minimum near the accelerations `guess`, (N, n); `solved` says whether it is one.

        Raises:
            HandrailError: CasADi fails; that the solver does not converge is no failure.
        """
        start = perf_counter()
        limit = problem.limits.acceleration
        here = self._iterate(problem, np.clip(guess, -limit, limit))
        share, total, done = _LARGEST_TRUST, 0, False
        for _ in range(self._rounds):
            solution, after, iterations = self._step(problem, here, share * limit)
            total += iterations
            if not solution.solved:
                break
            promised, change = here.cost - solution.cost, float(np.abs((after.u - here.u) / limit).max())
            exact = here.distances.rows == after.distances.rows == 0  # nothing was linearised
            share = _next_trust(share, change, (here.cost - after.cost) / max(promised, 1e-12))
            if after.cost <= here.cost * (1.0 + _NOISE) + _NOISE:
                here = after
            done = exact or promised <= self._tolerance * (1.0 + here.cost) or share <= _SMALLEST_TRUST
            if done:
                break
        return self._plan(problem, here, done, total, perf_counter() - start)

    def _step(self, problem: Problem, here: _Iterate, trust: FloatArray) -> tuple[Solution, _Iterate, int]:
        """Return the program's solution, the best iterate found with it, and iterations.

        Where the distances curve, the exact cost at the solution is much higher than promised: the rows are
        then made exact there, gradients kept, and the program is solved again (a second-order correction).
        """
        limit = problem.limits.acceleration
        program, distances = self._program(here.distances.rows), here.distances
        first = solution = program.solve(problem, here.u, distances, trust)
        best = self._iterate(problem, np.clip(first.u, -limit, limit))
        after, total = best, first.iterations
        for _ in range(_CORRECTIONS if distances.rows else 0):
            if here.cost - best.cost >= _ENOUGH * (here.cost - first.cost) or not solution.solved:
                break
            solution = program.solve(problem, here.u, distances.anchored(problem, after.u), trust)
            after = self._iterate(problem, np.clip(solution.u, -limit, limit))
            best = after if after.cost < best.cost else best
            total += solution.iterations
        return first, best, total

    def _iterate(self, problem: Problem, u: FloatArray) -> _Iterate:
        return _Iterate(u, self._evaluate(problem, u).cost, linear_distances(problem, u))

    def _program(self, rows: int) -> MultistageProgram:
        if rows not in self._programs:
            self._programs[rows] = MultistageProgram(*self._arguments, rows)
        return self._programs[rows]

    def _plan(self, problem: Problem, here: _Iterate, solved: bool, iterations: int, seconds: float) -> Plan:
        u = here.u
        q, v = problem.rollout(u)
        exact = self._evaluate(problem, u)
        return Plan(
            q=q,
            v=v,
            u=u,
            collision_slack=exact.collision_slack,
            limit_slack=exact.limit_slack,
            distances=problem.collision.values(problem.q[None])[0],
            solved=solved,
            iterations=iterations,
            tracking_error=self._evaluate.tracking_error(problem, u),
            rows=here.distances.rows * (problem.horizon + STOPS),
            phases=(("solve", seconds),),
        )


def _next_trust(share: float, change: float, kept: float) -> float:
    """Return the next trust region, given which share of the promised improvement was kept."""
    if kept < 0.25:
        return 0.25 * min(share, change)
    return min(2.0 * share, _LARGEST_TRUST) if kept > _ENOUGH else share

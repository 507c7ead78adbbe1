"""The real-time solver: Gauss-Newton, states condensed out, one dense warm-started QP an update."""

from dataclasses import replace
from time import perf_counter

import daqp
import numpy as np
from scipy.linalg.lapack import dposv  # pyright: ignore[reportAttributeAccessIssue]  (made at build time)

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision import Distances
from handrail.controllers.condensing import CondensedCost
from handrail.controllers.problem import Plan, Problem
from handrail.controllers.residuals import StageResiduals
from handrail.controllers.rows import LimitRows, Nodes, Rows, distance_rows

_INFINITE = 1e30
_ROUNDS = 12  # of adding violated rows
_CLOSE = 0.05  # a distance row this near to its bound is in the QP from the start [m]
_TOLERANCE = 1e-6  # of a row
_MORE_STEPS = 2  # at most, in one update
_LARGE = 0.2  # change of an acceleration that asks for another step, relative to its limit
_HALVINGS = 4  # of a step that makes the cost rise
_UPPER, _LOWER = 1, 3  # DAQP's marks of a row that is active at its upper or lower bound


class RealTimeSolver:
    """One Gauss-Newton step around a guess.

    Variables of the QP: the changes δ of the accelerations, (N n,), a slack of the distances [m] and a
    slack of the limits (relative). Where the unconstrained step obeys everything, it is the solution;
    otherwise DAQP solves the QP, beginning with the rows that were active in the last update.
    """

    def __init__(self, residuals: StageResiduals, horizon: int, size: int, dt: float) -> None:
        self._cost = CondensedCost(residuals, horizon, size, dt)
        self._shape = (horizon, size)
        self.reset()

    @property
    def cost(self) -> CondensedCost:
        """The cost that the QP is made of."""
        return self._cost

    def reset(self) -> None:
        """Forget which rows were active."""
        self._active: dict[int, int] = {}
        self._active_bounds = np.zeros(self._shape[0] * self._shape[1] + 2, dtype=np.int32)

    def solve(self, problem: Problem, guess: FloatArray) -> Plan:
        """Return the plan after one step from the accelerations `guess`, (N, n).

        Right after the intent or the scene has jumped, the guess is far off; a step that is still large is
        followed by another.
        """
        plan, change = self._step(problem, guess)
        for _ in range(_MORE_STEPS):
            if not plan.solved or np.max(np.abs(change) / problem.limits.acceleration) < _LARGE:
                break
            spent = plan.phases
            plan, change = self._step(problem, plan.u)
            phases = [(name, a + b) for (name, a), (_, b) in zip(spent, plan.phases, strict=True)]
            plan = replace(plan, phases=tuple(phases))
        return plan

    def _step(self, problem: Problem, guess: FloatArray) -> tuple[Plan, FloatArray]:
        """Return the plan after one step, and the step itself, (N, n)."""
        start = perf_counter()
        limit = problem.limits.acceleration
        guess, q, v, nodes, distances = self._linearisation(problem, guess)
        rows = distance_rows(problem, nodes, distances)
        limits = LimitRows(problem, q[1:], v[1:], self._cost.coefficients)
        measured = perf_counter()
        hessian, gradient = self._cost.build(problem, q[1:], v[1:], guess)
        built = perf_counter()
        qp = _Qp(problem, guess, hessian, gradient, rows)
        change, slack, solved, iterations, count = self._solve(qp, limits)
        if solved:
            before = np.array([max(0.0, -float(rows.upper.min(initial=0.0))), limits.excess])
            change = self._damped(problem, (guess, q, v), change, before, slack)
        u = np.minimum(np.maximum(guess + change, -limit), limit)
        q, v = problem.rollout(u)
        done = perf_counter()
        phases = (("distances", measured - start), ("residuals", built - measured), ("solve", done - built))
        plan = Plan(
            q=q,
            v=v,
            u=u,
            collision_slack=float(slack[0]),
            limit_slack=float(slack[1]),
            distances=distances.values[0],
            solved=solved,
            iterations=iterations,
            tracking_error=self._cost.tracking_error(problem, change),
            rows=count,
            phases=phases,
        )
        return plan, change

    def _linearisation(
        self, problem: Problem, guess: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, Nodes, Distances]:
        """Return what to linearise around: the guess, or a full stop where the guess runs into something.

        Inside an obstacle the nearest way out may be the far side, so a colliding guess would be pulled
        through; the stop is free of collision, since the last update made sure that it is.
        """
        limit = problem.limits.acceleration
        for candidate in (guess, None):
            u = _stop(problem) if candidate is None else np.minimum(np.maximum(candidate, -limit), limit)
            q, v = problem.rollout(u)
            nodes = Nodes(problem, q, v, self._cost.coefficients)
            distances = problem.collision.distances(nodes.q, problem.margins + problem.reach, nodes.times)
            worst = np.min(distances.values - np.minimum(distances.values[0], 0.0), initial=np.inf)
            if worst >= 0.0:
                break
        return u, q, v, nodes, distances

    def _damped(
        self,
        problem: Problem,
        start: tuple[FloatArray, FloatArray, FloatArray],
        change: FloatArray,
        before: FloatArray,
        after: FloatArray,
    ) -> FloatArray:
        """Return the change, halved until the cost itself falls: Gauss-Newton alone may go round in circles.

        The QP's constraints are convex, so that with no slack before and s after the whole change a share α
        of it needs no more than `α s`.

        Args:
            problem: of this update.
            start: accelerations, positions and velocities of the guess.
            change: of the accelerations, (N, n).
            before: slacks that the guess needs, (2,).
            after: slacks of the QP's solution, (2,).
        """
        if before.any():  # a guess that breaks a limit is left behind whole
            return change
        guess, q, v = start
        limit = problem.limits.acceleration
        allowed = self._cost.value(problem, q[1:], v[1:], guess)
        share = 1.0
        for _ in range(_HALVINGS):
            u = np.minimum(np.maximum(guess + share * change, -limit), limit)
            q, v = problem.rollout(u)
            cost = self._cost.value(problem, q[1:], v[1:], u)
            if cost + _penalty(problem, share * after) <= allowed:
                break
            share *= 0.5
        return share * change

    def _solve(self, qp: "_Qp", limits: LimitRows) -> tuple[FloatArray, FloatArray, bool, int, int]:
        """Solve with the rows that matter; add those that the solution breaks; solve again."""
        free = qp.unconstrained()
        if free is not None and limits.violated(free.reshape(self._shape), 0.0) is None:
            self.reset()
            return free.reshape(self._shape), np.zeros(2), True, 0, 0
        qp.begin(limits.near(), self._active)
        total = 0
        for _ in range(_ROUNDS):
            solution, flag, multipliers, iterations = qp.solve(self._active_bounds, self._active)
            total += iterations
            change, slack = solution[:-2].reshape(self._shape), solution[-2:]
            if flag <= 0:
                self.reset()
                return change, slack, False, total, qp.size
            self._remember(qp, multipliers)
            broken = qp.broken(solution)
            more = limits.violated(change, slack[1])
            if more is None and not broken:
                break
            qp.extend(more)
        return change, slack, True, total, qp.size

    def _remember(self, qp: "_Qp", multipliers: FloatArray) -> None:
        bounds = len(self._active_bounds)
        marks = np.where(multipliers > 0, _UPPER, np.where(multipliers < 0, _LOWER, 0)).astype(np.int32)
        self._active_bounds = marks[:bounds]
        held = np.flatnonzero(marks[bounds:])
        self._active = dict.fromkeys(qp.keys[held].tolist(), _UPPER)


def _penalty(problem: Problem, slack: FloatArray) -> float:
    return float(problem.slack_linear * slack.sum() + 0.5 * problem.slack_quadratic * (slack @ slack))


def _stop(problem: Problem) -> FloatArray:
    """Return the accelerations of the fastest stop, (N, n)."""
    limit = problem.limits.acceleration * problem.dt
    stages = np.arange(problem.horizon)[:, None]
    left = np.maximum(np.abs(problem.v) - stages * limit, 0.0)
    return -np.sign(problem.v) * np.minimum(left, limit) / problem.dt


class _Qp:
    """`min ½ xᵀ H x + gᵀ x` with bounds and rows, x = (δ, s)."""

    def __init__(
        self, problem: Problem, guess: FloatArray, hessian: FloatArray, gradient: FloatArray, rows: Rows
    ) -> None:
        size = len(gradient)
        self._free_hessian, self._free_gradient = hessian, gradient
        self._slack = (problem.slack_linear, problem.slack_quadratic)
        acceleration = np.broadcast_to(problem.limits.acceleration, guess.shape)
        self._lower = np.zeros(size + 2)
        self._upper = np.full(size + 2, _INFINITE)
        self._lower[:-2] = (-acceleration - guess).ravel()
        self._upper[:-2] = (acceleration - guess).ravel()
        self._candidates = rows
        self._used = np.zeros(len(rows.upper), dtype=bool)
        self._limits: list[Rows] = []
        self._parts: list[Rows] = []

    @property
    def size(self) -> int:
        """Number of rows in use."""
        return sum(len(part.upper) for part in self._parts)

    @property
    def keys(self) -> IntArray:
        """Keys of the rows in use, (R,)."""
        return np.concatenate([part.keys for part in self._parts])

    def unconstrained(self) -> FloatArray | None:
        """Return the step without bounds and rows, (N n,), if it obeys them all."""
        _, step, info = dposv(self._free_hessian, -self._free_gradient, lower=1)
        if info or (step < self._lower[:-2]).any() or (step > self._upper[:-2]).any():
            return None
        rows = self._candidates
        return None if (rows.matrix[:, :-2] @ step > rows.upper).any() else step

    def begin(self, limits: Rows | None, active: dict[int, int]) -> None:
        """Take the rows that are close to their bound or were active, and some limits."""
        rows = self._candidates
        self._used = rows.upper < _CLOSE
        if active:
            self._used |= np.isin(rows.keys, list(active))
        self.extend(limits)

    def broken(self, solution: FloatArray) -> bool:
        """Take the distance rows that a solution breaks; return whether there were any."""
        rows = self._candidates
        broken = (rows.matrix @ solution > rows.upper + _TOLERANCE) & ~self._used
        self._used |= broken
        return bool(broken.any())

    def extend(self, limits: Rows | None) -> None:
        """Take more limits, if any; the next `solve` is with all rows taken so far."""
        if limits is not None:
            self._limits.append(limits)
        self._parts = [self._candidates.take(self._used), *self._limits]

    def solve(self, bounds: IntArray, active: dict[int, int]) -> tuple[FloatArray, int, FloatArray, int]:
        """Return solution, DAQP's exit flag, multipliers and iterations, begun from rows held active."""
        hessian, gradient = self._with_slack()
        matrix = np.concatenate([part.matrix for part in self._parts])
        upper = np.concatenate([self._upper, *(part.upper for part in self._parts)])
        lower = np.full(len(upper), -_INFINITE)
        lower[: len(self._lower)] = self._lower
        sense = np.zeros(len(upper), dtype=np.int32)
        sense[: len(bounds)] = bounds
        if active:
            sense[len(bounds) :] = [active.get(key, 0) for key in self.keys.tolist()]
        x, _, flag, info = daqp.solve(hessian, gradient, matrix, upper, lower, sense)
        if flag <= 0:
            x, _, flag, info = daqp.solve(hessian, gradient, matrix, upper, lower)
        return x, flag, info["lam"], info["iterations"]

    def _with_slack(self) -> tuple[FloatArray, FloatArray]:
        linear, quadratic = self._slack
        size = len(self._free_gradient)
        hessian = np.zeros((size + 2, size + 2))
        hessian[:size, :size] = self._free_hessian
        hessian[size, size] = hessian[size + 1, size + 1] = quadratic
        return hessian, np.append(self._free_gradient, [linear, linear])

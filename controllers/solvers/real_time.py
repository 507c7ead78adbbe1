"""The real-time solver: Gauss-Newton steps, each a banded QP solved by a warm-started active-set method."""

from time import perf_counter
from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.distance_kernels import depth
from handrail.controllers.collision.model import Distances
from handrail.controllers.collision.slacks import LIMITS
from handrail.controllers.ocp.motion import changed, within
from handrail.controllers.ocp.nodes import Nodes
from handrail.controllers.ocp.problem import Plan, Problem
from handrail.controllers.ocp.residuals import StageResiduals
from handrail.controllers.solvers.active_set import NOTHING_ACTIVE, ActiveSet, Answer, QuadraticProgram
from handrail.controllers.solvers.constraints import Constraints, constraints_around
from handrail.controllers.solvers.stage_cost import StageCost

_PHASES = ("distances", "residuals", "solve")
_MORE_STEPS = 2  # at most, in one update
_LARGE = 0.2  # change of an acceleration near obstacles that asks for another step, relative to its limit
_COARSE = 0.01  # share of the promised descent by which a linearised cost may be wrong,
_SMALL = 0.1  # or of a descent that is this share of the cost
_SMALLEST_SHARE = 1.0 / 16.0  # of a step that makes the cost rise
_WORK = 3e7  # of all QPs of an update, counted as active_set.py does: some 20 ms


class _Guess(NamedTuple):
    """What a step is taken from: positions and velocities at the nodes, accelerations, distances."""

    q: FloatArray
    v: FloatArray
    u: FloatArray
    nodes: Nodes
    distances: Distances
    depth: float  # by which pairs overlap that do not now, or not as much [m]


class RealTimeSolver:
    """Gauss-Newton steps around a guess, usually one.

    The QP's variables have local support (basis.py), so that its Hessian is banded and the cost of an update
    grows linearly with the horizon.

    Attributes:
        cost: of all stages.
        qp: solves the QPs.
    """

    def __init__(self, residuals: StageResiduals, horizon: int, size: int, dt: float) -> None:
        self.cost = StageCost(residuals, horizon, size, dt)
        self.qp = ActiveSet(horizon, size)

    def solve(self, problem: Problem, guess: FloatArray, active: IntArray = NOTHING_ACTIVE) -> Plan:
        """Return the plan after one step from a guess.

        Right after the intent or the scene has jumped, the guess is far off; a step that is still large, and
        did not lead where its linearisation said, is followed by another. The work of an update is bounded:
        what is reached when it is spent is the plan, which is certified like any other.

        Args:
            problem: of this update.
            guess: accelerations, (N, n).
            active: numbers of the rows expected to be active, as a plan among the same pairs has them.
        """
        spent, work = [0.0] * len(_PHASES), _WORK
        for _ in range(1 + _MORE_STEPS):
            step = self._step(problem, guess, active, work, spent)
            active, work = step.answer.active, step.answer.work_left
            if not step.again:
                break
            guess = step.moved.u
        slack = step.answer.slack
        return Plan(
            q=step.moved.q,
            v=step.moved.v,
            u=step.moved.u,
            collision_slack=max(slack[:LIMITS].tolist()),
            limit_slack=float(slack[LIMITS]),
            distances=step.distances,
            solved=step.answer.solved,
            iterations=step.answer.changes,
            rows=step.rows,
            active=active,
            phases=tuple(zip(_PHASES, spent, strict=True)),
        )

    def program(self, problem: Problem, guess: FloatArray) -> QuadraticProgram:
        """Return the QP of the step from a guess, (N, n); H and g last until the next update."""
        begin = self._linearisation(problem, guess)
        return self._program(problem, begin, self._constraints(problem, begin))[1]

    def _constraints(self, problem: Problem, begin: _Guess) -> Constraints:
        return constraints_around(problem, begin[:3], begin.nodes, begin.distances, self.cost.matrix)

    def _program(
        self, problem: Problem, begin: _Guess, constraints: Constraints
    ) -> tuple[float, QuadraticProgram]:
        value, gradient, band = self.cost.expand(problem, *begin[:3])
        penalty = (problem.slack_linear, problem.slack_quadratic)
        return value, QuadraticProgram(band, gradient, penalty, constraints)

    def _step(
        self, problem: Problem, guess: FloatArray, active: IntArray, work: float, spent: list[float]
    ) -> "_Step":
        """Take one step; add the time that its phases take."""
        start = perf_counter()
        begin = self._linearisation(problem, guess)
        constraints = self._constraints(problem, begin)
        measured = perf_counter()
        value, program = self._program(problem, begin, constraints)
        built = perf_counter()
        answer = self.qp.solve(program, active, work)
        moved = self._damped(problem, begin.u, value, answer.slack, constraints)
        again = answer.solved and answer.work_left > 0.0
        again = again and self._is_far(problem, constraints, value, answer, moved)
        spent[0] += measured - start
        spent[1] += built - measured
        spent[2] += perf_counter() - built
        return _Step(answer, moved, begin.distances.values[0], len(constraints.row), again)

    def _is_far(
        self, problem: Problem, constraints: Constraints, before: float, answer: Answer, moved: "_Moved"
    ) -> bool:
        """Whether a step's linearisation was too coarse: of the cost, or of distances after a large step."""
        wrong = abs(moved.cost - before - answer.descent)
        if wrong > _COARSE * max(abs(answer.descent), _SMALL * moved.cost):
            return True
        return max(answer.active.tolist(), default=0) >= constraints.first and not within(
            moved.change, _LARGE * problem.limits.acceleration
        )

    def _linearisation(self, problem: Problem, guess: FloatArray) -> _Guess:
        """Return what to linearise around: the guess, or a full stop where the guess runs into something.

        Inside an obstacle the nearest way out may be the far side, so a colliding guess would be pulled
        through; the stop is free of collision, since the last update made sure that it is. Where an obstacle
        comes at the robot neither may be, and the one is taken that runs into it less.
        """
        begin = _measured(problem, *_rolled_out(problem, guess, np.zeros_like(guess)))
        if begin.depth <= 0.0:
            return begin
        stop = _stop(problem)
        stopped = _measured(problem, *_rolled_out(problem, stop, np.zeros_like(stop)))
        return stopped if stopped.depth <= begin.depth else begin

    def _damped(
        self, problem: Problem, guess: FloatArray, allowed: float, slack: FloatArray, constraints: Constraints
    ) -> "_Moved":
        """Take the step, halved until the cost itself falls: Gauss-Newton alone may go round in circles.

        The QP's constraints are convex, so that from a guess within them a share α of the change needs no
        more slack than α times that of the whole; a guess that breaks a limit is left behind whole.
        """
        change, share = self.qp.motion[:, 2].copy(), 1.0
        while True:
            q, v, u = _rolled_out(problem, guess, change)
            cost = self.cost.value(problem, q, v, u)
            lower = cost + _penalty(problem, share * slack) <= allowed
            if lower or share <= _SMALLEST_SHARE or constraints.broken:
                return _Moved(q, v, u, change, cost)
            change *= 0.5
            share *= 0.5


class _Step(NamedTuple):
    """A step, the distances now, (P,), the number of distance rows, and whether to take another."""

    answer: Answer
    moved: "_Moved"
    distances: FloatArray
    rows: int
    again: bool


class _Moved(NamedTuple):
    """A step taken: the motion after it, the change of the accelerations, the cost."""

    q: FloatArray
    v: FloatArray
    u: FloatArray
    change: FloatArray
    cost: float


def _rolled_out(problem: Problem, guess: FloatArray, change: FloatArray) -> tuple[FloatArray, ...]:
    """Return positions and velocities at the nodes, and accelerations within their limits."""
    return changed(problem.q, problem.v, problem.dt, guess, change, problem.limits.acceleration)


def _measured(problem: Problem, q: FloatArray, v: FloatArray, u: FloatArray) -> _Guess:
    nodes = Nodes(problem, q, v)
    distances = problem.collision.distances(nodes.q, problem.active_within, nodes.times)
    return _Guess(q, v, u, nodes, distances, depth(distances.values))


def _penalty(problem: Problem, slack: FloatArray) -> float:
    return float(problem.slack_linear * slack.sum() + 0.5 * problem.slack_quadratic * (slack @ slack))


def _stop(problem: Problem) -> FloatArray:
    """Return the accelerations of the fastest stop, (N, n)."""
    limit = problem.limits.acceleration * problem.dt
    stages = np.arange(problem.horizon)[:, None]
    left = np.maximum(np.abs(problem.v) - stages * limit, 0.0)
    return -np.sign(problem.v) * np.minimum(left, limit) / problem.dt

"""The controller's own QP solver against others, warm-started, on the QPs that the controller meets."""

from dataclasses import replace
from importlib import import_module
from time import perf_counter
from typing import Any, Protocol

import daqp
import numpy as np
from scipy import sparse

from handrail.collect.experiments.profiling.timing_loop import Case, TimingLoop, times
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import not_installed
from handrail.controllers.solvers.active_set import NOTHING_ACTIVE, ActiveSet, QuadraticProgram
from handrail.controllers.solvers.dense import DenseProgram, dense

_CASES = (
    Case("no_collision", own="none"),
    Case("pairs_30", own="few", obstacles=2),
    Case("pairs_100", obstacles=7),
)
_TOLERANCE = 1e-6  # of the interior-point method
_SMALL = 1e-3  # objective that counts as little


class QpSolver(Protocol):
    """One of those compared: what is not `solve` is not timed."""

    name: str

    def take(self, program: QuadraticProgram, same: DenseProgram) -> None:
        """Take the next QP of a sequence in the form that the solver wants."""

    def solve(self) -> FloatArray | None:
        """Return its solution (s, σ), (m,), or None."""


class Own:
    """The controller's active-set method; begins with the rows that were active in the last QP."""

    name = "own"

    def __init__(self, horizon: int, size: int) -> None:
        self._solver, self._active = ActiveSet(horizon, size), NOTHING_ACTIVE

    def take(self, program: QuadraticProgram, same: DenseProgram) -> None:
        """Copy H, which is overwritten."""
        self._program = program._replace(band=program.band.copy())

    def solve(self) -> FloatArray | None:
        """Return (s, σ)."""
        answer = self._solver.solve(self._program, self._active)
        self._active = answer.active
        dt = self._program.constraints.matrix[1, 2]  # v_k = dt (s_k - s_{k-1})
        s = np.cumsum(self._solver.motion[:, 1], axis=0) / dt
        return np.append(s, answer.slack) if answer.solved else None


class Daqp:
    """DAQP, a dual active-set method for dense QPs; begins with the rows that were active in the last QP."""

    name = "daqp"

    def __init__(self) -> None:
        self._active = np.zeros(0, dtype=np.int64)

    def take(self, program: QuadraticProgram, same: DenseProgram) -> None:
        """Mark the rows to begin with."""
        self._rows = same.rows
        sense = np.isin(same.rows, self._active).astype(np.int32)
        least = np.full(len(same.upper), -1e30)
        self._arguments = same.hessian, same.gradient, same.matrix, same.upper, least, sense

    def solve(self) -> FloatArray | None:
        """Return (s, σ)."""
        x, _, flag, info = daqp.solve(*self._arguments)
        self._active = self._rows[np.abs(info["lam"]) > 0.0]
        return x if flag > 0 else None


class Piqp:
    """PIQP, a proximal interior-point method, on sparse matrices; such methods cannot begin with a guess.

    Raises:
        HandrailError: PIQP is not installed.
    """

    name = "piqp"

    def __init__(self) -> None:
        try:
            self._piqp: Any = import_module("piqp")
        except ImportError as error:
            raise not_installed("the comparison of QP solvers", "piqp", "profile") from error

    def take(self, program: QuadraticProgram, same: DenseProgram) -> None:
        """Make the matrices sparse."""
        matrices = sparse.csc_matrix(same.hessian), sparse.csc_matrix(same.matrix)
        self._arguments = matrices[0], same.gradient, None, None, matrices[1], None, same.upper

    def solve(self) -> FloatArray | None:
        """Return (s, σ)."""
        solver = self._piqp.SparseSolver()
        solver.settings.kkt_solver = self._piqp.KKTSolver.sparse_ldlt_cond  # the fastest of its methods here
        solver.settings.eps_abs = solver.settings.eps_rel = _TOLERANCE
        solver.setup(*self._arguments)
        done = solver.solve() == self._piqp.Status.PIQP_SOLVED
        return np.array(solver.result.x) if done else None


def compare_qp(count: int, seed: int, horizons: tuple[int, ...] = (10, 40)) -> dict[str, Any]:
    """Solve so many QPs of every case with every solver in turn; return times and accuracy."""
    cases = [
        replace(case, name=f"{case.name}_horizon_{horizon}", horizon=horizon)
        for horizon in horizons
        for case in _CASES
    ]
    return {case.name: _compared(case, count, seed) for case in cases}


def _compared(case: Case, count: int, seed: int) -> dict[str, Any]:
    lane = TimingLoop(case, seed)
    solvers: tuple[QpSolver, ...] = (Own(case.horizon, lane.model.size), Daqp(), Piqp())
    every = []
    for _ in range(count + 1):
        if lane.at_new_scene:
            lane.begin()
        (update,) = lane.run(1)
        program = lane.mpc.solver.program(update.problem, update.guess)
        every.append(_Compared(program, solvers))
    every = every[1:]  # the first finds nothing warm
    return {
        "stages": case.horizon,
        "pairs": len(update.plan.distances),
        "variables": len(every[0].same.gradient),
        "rows_mean": float(np.mean([len(each.same.rows) for each in every])),
        "qps": count,
        "solvers": {solver.name: _measured(every, index) for index, solver in enumerate(solvers)},
    }


class _Compared:
    """One QP with all solvers' answers and times [s]."""

    def __init__(self, program: QuadraticProgram, solvers: tuple[QpSolver, ...]) -> None:
        self.same = dense(program)
        self.answers: list[FloatArray | None] = []
        self.seconds: list[float] = []
        for solver in solvers:
            solver.take(program, self.same)
            start = perf_counter()
            self.answers.append(solver.solve())
            self.seconds.append(perf_counter() - start)


def _measured(every: list[_Compared], index: int) -> dict[str, Any]:
    """Return times, our median over this one's, and how well the QPs are solved."""
    seconds = [each.seconds[index] for each in every]
    found = [(each.same, each.answers[0], each.answers[index]) for each in every]
    solved = [(same, own, x) for same, own, x in found if own is not None and x is not None]
    excess = [(same.value(x) - same.value(own)) / (_SMALL + abs(same.value(own))) for same, own, x in solved]
    return {
        **times(seconds),
        "ratio": float(np.median([each.seconds[0] for each in every]) / np.median(seconds)),
        "failed": sum(each.answers[index] is None for each in every),
        "violation": max((same.violation(x) for same, _, x in solved), default=None),
        "objective_excess": float(np.median(excess)) if excess else None,
        "objective_excess_worst": float(np.max(np.abs(excess))) if excess else None,
    }

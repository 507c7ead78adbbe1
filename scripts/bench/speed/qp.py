"""The controller's own QP solver against others, warm-started, on the QPs that the controller meets."""

from collections.abc import Callable
from importlib import import_module
from time import perf_counter
from typing import Any

import daqp
import numpy as np
from scipy import sparse

from handrail.controllers.arrays import FloatArray
from handrail.controllers.core.library import Memory, functions
from handrail.controllers.errors import not_installed
from handrail.controllers.solvers.dense import DenseProgram, dense
from handrail.controllers.solvers.real_time import NOTHING_ACTIVE
from handrail.scripts.bench.report import spread
from handrail.scripts.bench.speed.timing_loop import SpeedCase, TimingLoop, longer

_TOLERANCE = 1e-6  # of the interior-point method
_SMALL = 1e-3  # objective that counts as little

Solve = Callable[[], FloatArray | None]
"""What is timed: returns the solution (s, σ), (m,), or None."""

QpSolver = Callable[[Memory, Memory, DenseProgram], Solve]
"""Takes the next QP of a sequence, in the core and as dense matrices; the core solves it once, and last."""


def _own() -> QpSolver:
    """Return the controller's active-set method; begins with the rows that were active in the last QP."""
    active = NOTHING_ACTIVE

    def take(core: Memory, scene: Memory, same: DenseProgram) -> Solve:
        core.active[: len(active)], core.fields.active_rows, core.fields.work = active, len(active), np.inf
        solve_program = functions().solve_program

        def solve() -> FloatArray | None:
            nonlocal active
            solved = solve_program(core, scene)
            active = core.active[: core.fields.active_rows].copy()
            return np.append(core.s, core.slacks) if solved else None

        return solve

    return take


def _daqp() -> QpSolver:
    """Return DAQP, a dual active-set method for dense QPs; begins like our own."""
    active = np.zeros(0, dtype=np.int64)

    def take(core: Memory, scene: Memory, same: DenseProgram) -> Solve:
        sense = np.isin(same.rows, active).astype(np.int32)
        least = np.full(len(same.upper), -1e30)

        def solve() -> FloatArray | None:
            nonlocal active
            x, _, flag, info = daqp.solve(same.hessian, same.gradient, same.matrix, same.upper, least, sense)
            active = same.rows[np.abs(info["lam"]) > 0.0]
            return x if flag > 0 else None

        return solve

    return take


def _piqp() -> QpSolver:
    """Return PIQP, a proximal interior-point method, on sparse matrices; it cannot begin with a guess."""
    try:
        piqp: Any = import_module("piqp")
    except ImportError as error:
        raise not_installed("the comparison of QP solvers", "piqp", "profile") from error

    def take(core: Memory, scene: Memory, same: DenseProgram) -> Solve:
        hessian, matrix = sparse.csc_matrix(same.hessian), sparse.csc_matrix(same.matrix)

        def solve() -> FloatArray | None:
            solver = piqp.SparseSolver()
            solver.settings.kkt_solver = piqp.KKTSolver.sparse_ldlt_cond  # the fastest of its methods here
            solver.settings.eps_abs = solver.settings.eps_rel = _TOLERANCE
            solver.setup(hessian, same.gradient, None, None, matrix, None, same.upper)
            done = solver.solve() == piqp.Status.PIQP_SOLVED
            return np.array(solver.result.x) if done else None

        return solve

    return take


def compare_qp(count: int, seed: int, horizons: tuple[int, ...] = (10, 40)) -> dict[str, Any]:
    """Solve so many QPs of every case with every solver in turn; return times and accuracy."""
    return {case.name: _compared(case, count, seed) for case in longer(*horizons)}


def _compared(case: SpeedCase, count: int, seed: int) -> dict[str, Any]:
    loop = TimingLoop(case, seed)
    solvers = {"daqp": _daqp(), "piqp": _piqp(), "own": _own()}
    programs: list[DenseProgram] = []
    answers: dict[str, list[FloatArray | None]] = {name: [] for name in solvers}
    seconds: dict[str, list[float]] = {name: [] for name in solvers}
    for update in loop.run(count + 1):
        core, scene = loop.mpc.solver.program(update.problem, update.guess), update.problem.collision.memory
        programs.append(dense(core, scene))
        for name, take in solvers.items():
            solve = take(core, scene, programs[-1])
            start = perf_counter()
            answers[name].append(solve())
            seconds[name].append(perf_counter() - start)
    del programs[0]
    for values in (*answers.values(), *seconds.values()):
        del values[0]  # the first finds nothing warm
    ratios = {name: float(np.median(seconds["own"]) / np.median(seconds[name])) for name in solvers}
    return {
        "stages": case.horizon,
        "pairs": loop.mpc.loop.surroundings.collision.size,
        "variables": len(programs[0].gradient),
        "rows_mean": float(np.mean([len(each.rows) for each in programs])),
        "qps": count,
        "solvers": {
            name: {**spread(seconds[name]), "ratio": ratios[name]}
            | _accuracy(programs, answers["own"], answers[name])
            for name in solvers
        },
    }


def _accuracy(
    programs: list[DenseProgram], own: list[FloatArray | None], answers: list[FloatArray | None]
) -> dict[str, Any]:
    """Return how well QPs are solved, and by how much the objective is above our own."""
    both = zip(programs, own, answers, strict=True)
    solved = [(same, ours, x) for same, ours, x in both if ours is not None and x is not None]
    excess = [
        (same.value(x) - same.value(ours)) / (_SMALL + abs(same.value(ours))) for same, ours, x in solved
    ]
    return {
        "failed": sum(x is None for x in answers),
        "violation": max((same.violation(x) for same, _, x in solved), default=None),
        "objective_excess": float(np.median(excess)) if excess else None,
        "objective_excess_worst": float(np.max(np.abs(excess))) if excess else None,
    }

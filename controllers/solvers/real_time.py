"""The real-time solver: Gauss-Newton steps, each a banded QP, by a warm-started active-set method in C.

The QP's variables have local support (core/motion.c), so that its Hessian is banded and the cost of an update
grows linearly with the horizon.
"""

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray, frozen
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.collision.slacks import LIMITS, SLACKS
from handrail.controllers.core.library import Memory, functions
from handrail.controllers.ocp.problem import Plan, Problem
from handrail.controllers.ocp.residuals import StageResiduals

NOTHING_ACTIVE = np.arange(SLACKS)  # only the slacks are at rest: none is negative
WORK = 2e5  # of all QPs of an update for each variable, counted as core/active_set.c does
_ROUNDING = 2e-5  # of a joint's range, that the QP leaves


class RealTimeSolver:
    """Gauss-Newton steps around a guess, usually one, in the compiled core.

    Args:
        residuals: of all stages.
        horizon: stages N.
        size: coordinates n.
    """

    def __init__(self, residuals: StageResiduals, horizon: int, size: int) -> None:
        self._residuals, self._shape = residuals, (horizon, size)
        self._collision: CollisionModel | None = None
        self._weights: FloatArray | None = None
        self._core: Memory | None = None

    def solve(self, problem: Problem, guess: FloatArray, active: IntArray = NOTHING_ACTIVE) -> Plan:
        """Return the plan after one step from a guess; its `solved` says whether it is one.

        Right after the intent or the scene has jumped, the guess is far off; a step that did not lead where
        its linearisation said is followed by another. The work of an update is bounded: the plan reached
        when it is spent is certified like any other.

        Args:
            problem: of this update.
            guess: accelerations, (N, n).
            active: numbers of the rows expected to be active, as a plan among the same pairs has them.
        """
        core = self._asked(problem, guess)
        core.active[: len(active)] = active
        core.fields.active_rows, core.fields.work = len(active), WORK * core.fields.M
        functions().solve_update(core, problem.collision.memory)
        problem.collision.check()
        slacks, half = core.slacks.tolist(), core.joint_scale[0]
        excess = float((np.abs(core.path[1:] - core.lower - half) / half).max()) - 1.0 - _ROUNDING
        return Plan(
            q=frozen(core.path),
            v=frozen(core.speeds),
            u=frozen(core.u),
            collision_slack=max(*slacks[:LIMITS], core.fields.shortfall),
            limit_slack=max(slacks[LIMITS], excess),  # the plan may not keep all rows where the work ended
            distances=frozen(core.distances),
            solved=bool(core.fields.solved),
            rows=core.fields.rows,
            active=core.active[: core.fields.active_rows].copy(),
        )

    def program(self, problem: Problem, guess: FloatArray) -> Memory:
        """Return the core with the QP of the step from a guess, (N, n); it lasts until the next update."""
        core = self._asked(problem, guess)
        functions().build_program(core, problem.collision.memory)
        problem.collision.check()
        return core

    def _asked(self, problem: Problem, guess: FloatArray) -> Memory:
        """Return the core with a problem and a guess in it."""
        core = self._core
        if core is None or self._collision is not problem.collision:
            core = self._core = self._memory(problem)
            self._collision, self._weights = problem.collision, None
        core.q[:], core.v[:], core.sent[:] = problem.q, problem.v, problem.sent
        core.margins[:], core.reference[:], core.guess[:] = problem.margins, problem.reference, guess
        core.shift[:] = problem.range_shift
        self._residuals.set_parameters(problem.parameters)
        if self._weights is not problem.weights:
            core.weights[:] = self._weights = problem.weights
            functions().constant_hessian(core)
        return core

    def _memory(self, problem: Problem) -> Memory:
        residuals, limits, (count, n) = self._residuals, problem.limits, self._shape
        affine = residuals.affine
        row, column = np.nonzero(affine.jacobian)
        sizes = {"N": count, "n": n, "K": count + 3, "M": count * n, "V": count * n + SLACKS, "B": 3 * n}
        rows = {"R": len(residuals.reference), "A": len(affine.index), "C": len(residuals.curved)}
        core = Memory("Core", sizes | rows | {"E": len(row), "P": problem.collision.size}, residuals.arrays)
        core.begins[:] = np.searchsorted(row, np.arange(len(affine.index) + 1))
        core.columns[:], core.entries[:] = column, affine.jacobian[row, column]
        core.offset[:], core.affine[:], core.curved[:] = affine.offset, affine.index, residuals.curved
        core.lower[:], core.upper[:] = limits.position_lower, limits.position_upper
        core.v_max[:], core.a_max[:] = limits.velocity, limits.acceleration
        fields = core.fields
        fields.dt, fields.activation = problem.dt, problem.activation_distance
        fields.linear, fields.quadratic = problem.slack_linear, problem.slack_quadratic
        fields.known_changes = -1
        core.call_back("evaluate", residuals.evaluate)
        core.call_back("evaluate_values", residuals.evaluate_values)
        return core

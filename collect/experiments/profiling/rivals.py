"""What the controller is measured against: the converged solver on its problem, and mink."""

from time import perf_counter

import numpy as np

from handrail.collect.experiments.mink.scene import (
    avoidance,
    import_mink,
    qp_solvers,
    shape_model,
    standing_pairs,
)
from handrail.collect.experiments.profiling.timing_loop import PERIOD, TimingLoop, Update
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.solvers.converged import ConvergedSolver


class Converged:
    """IPOPT, converged, on problems of a lane, begun from the same guess.

    Args:
        lane: whose problems.
        every: solve only one of so many.
    """

    name = "ipopt"

    def __init__(self, lane: TimingLoop, every: int) -> None:
        settings = lane.mpc.settings
        self._solver = ConvergedSolver(lane.mpc.residuals, settings.horizon, lane.model.size, settings.dt)
        self._every, self._count, self._built = every, 0, False
        self.seconds: list[float] = []  # of the solves that converged
        self.ours: list[float] = []  # of the controller on the same problems
        self.failed = 0

    def begin(self, lane: TimingLoop) -> None:
        """Take a new scene: it comes with the problems."""

    def run(self, updates: list[Update]) -> None:
        """Time some of these updates' problems."""
        for update in updates:
            self._count += 1
            if self._count % self._every:
                continue
            if not self._built:
                self._solver.solve(update.problem, update.guess)
                self._built = True
            start = perf_counter()
            plan = self._solver.solve(update.problem, update.guess)
            seconds = perf_counter() - start
            if plan.solved:
                self.seconds.append(seconds)
                self.ours.append(update.seconds)
            else:
                self.failed += 1


class Mink:
    """Differential inverse kinematics with mink: one step with the same shapes, pairs, margins and limits.

    One step is `Configuration.update(q)` and `solve_ik` with a `FrameTask` on the tool, a `PostureTask` that
    is next to nothing, a `ConfigurationLimit`, a `VelocityLimit` and a `CollisionAvoidanceLimit` over the
    lane's pairs. Of the QP solvers that mink finds the fastest counts.

    Args:
        lane: whose robot, scenes and states.
        reach: distance at which a pair enters mink's problem [m].

    Raises:
        HandrailError: mink is not installed.
    """

    name = "mink"

    def __init__(self, lane: TimingLoop, reach: float) -> None:
        self._mink = import_mink()
        self._solvers = qp_solvers()
        self._reach = reach
        self._by_solver: dict[str, list[float]] = {solver: [] for solver in self._solvers}
        self.failed = 0
        self.pairs = 0
        self.ours: list[float] = []

    @property
    def solver(self) -> str:
        """The QP solver that was the fastest."""
        return min(self._solvers, key=lambda solver: np.median(self._by_solver[solver]))

    @property
    def seconds(self) -> list[float]:
        """Times of its steps [s]."""
        return self._by_solver[self.solver]

    def begin(self, lane: TimingLoop) -> None:
        """Build MuJoCo's model of a new scene, and mink's tasks and limits."""
        mink, model = self._mink, shape_model(lane.model, lane.obstacles)
        self._configuration = mink.Configuration(model)
        self._task = mink.FrameTask("tool", "site", position_cost=1.0, orientation_cost=1.0)
        posture = mink.PostureTask(model, cost=1e-3)
        posture.set_target(lane.model.description.home)
        limits = lane.model.description.limits
        speeds = dict(zip(lane.model.joints, limits.velocity.tolist(), strict=True))
        margin = MpcSettings().margin
        avoid = avoidance(model, standing_pairs(lane.model, lane.obstacles), margin, self._reach)
        self.pairs = avoid.max_num_contacts
        self._tasks = [self._task, posture]
        self._limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, speeds), avoid]

    def run(self, updates: list[Update]) -> None:
        """Time a step from the states of these updates, with each QP solver in turn."""
        for update in updates:
            self._set_target(update)
            self.ours.append(update.seconds)
            for solver in self._solvers:
                self._by_solver[solver].append(self._step(update, solver))

    def _set_target(self, update: Update) -> None:
        mink, values = self._mink, update.intent.values
        self._configuration.update(update.state.q)
        now = self._configuration.get_transform_frame_to_world("tool", "site")
        moved = now.translation() + PERIOD * values[3:6] * update.intent.mask[3:6]
        self._task.set_target(mink.SE3.from_rotation_and_translation(now.rotation(), moved))

    def _step(self, update: Update, solver: str) -> float:
        start = perf_counter()
        try:
            self._configuration.update(update.state.q)
            self._mink.solve_ik(
                self._configuration, self._tasks, PERIOD, solver, damping=1e-6, limits=self._limits
            )
        except (self._mink.MinkError, ValueError, RuntimeError):
            self.failed += 1
        return perf_counter() - start

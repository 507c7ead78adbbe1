"""What the controller is measured against: converged solvers on its problem, and mink."""

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from handrail.collect.profile_lane import PERIOD, Lane, Update
from handrail.controllers.converged import ConvergedSolver
from handrail.controllers.errors import HandrailError
from handrail.controllers.model import RobotModel
from handrail.controllers.settings import MpcSettings
from handrail.controllers.shape import Obstacle

_SOLVERS = ("daqp", "proxqp", "quadprog")  # PIQP is slower than these and prints


class Converged:
    """IPOPT or FATROP, converged, on problems of a lane, begun from the same guess.

    Args:
        lane: whose problems.
        backend: `ipopt` or `fatrop`.
        every: solve only one of so many.
    """

    def __init__(self, lane: Lane, backend: str, every: int) -> None:
        settings, self.name = lane.mpc.settings, backend
        arguments = (lane.mpc.residuals, settings.horizon, lane.model.size, settings.dt)
        self._solver = ConvergedSolver(*arguments, backend=backend)
        self._every, self._count, self._built = every, 0, False
        self.seconds: list[float] = []  # of the solves that converged
        self.ours: list[float] = []  # of the controller on the same problems
        self.failed = 0

    def begin(self, lane: Lane) -> None:
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

    def __init__(self, lane: Lane, reach: float) -> None:
        try:
            import mink
            import qpsolvers
        except ImportError as error:
            raise HandrailError("handrail-profile: expected mink, found none; pip install mink") from error
        self._mink = mink
        self._solvers = tuple(name for name in _SOLVERS if name in qpsolvers.available_solvers)
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

    def begin(self, lane: Lane) -> None:
        """Build MuJoCo's model of a new scene, and mink's tasks and limits."""
        mink, model = self._mink, _mujoco_model(lane.model, lane.obstacles)
        self._configuration = mink.Configuration(model)
        self._task = mink.FrameTask("tool", "site", position_cost=1.0, orientation_cost=1.0)
        posture = mink.PostureTask(model, cost=1e-3)
        posture.set_target(lane.model.description.home)
        limits = lane.model.description.limits
        speeds = dict(zip(lane.model.joints, limits.velocity.tolist(), strict=True))
        margin = MpcSettings().margin
        avoid = _every_pair(mink)(
            model,
            [([first], [second]) for first, second in _pairs(lane)],
            minimum_distance_from_collisions=margin,
            collision_detection_distance=self._reach,
        )
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


def _every_pair(mink: Any) -> Any:
    """Return mink's limit without its filter, which drops neighbours: base against obstacle, for one."""

    class EveryPair(mink.CollisionAvoidanceLimit):
        def _construct_geom_id_pairs(self, geom_pairs: Any) -> list[tuple[int, int]]:
            return [(self.model.geom(a).id, self.model.geom(b).id) for (a,), (b,) in geom_pairs]

    return EveryPair


def _pairs(lane: Lane) -> tuple[tuple[str, str], ...]:
    description = lane.model.description
    return (
        *description.self_pairs,
        *((name, "floor") for name in description.floor_shapes),
        *((name, obstacle.name) for name in description.scene_shapes for obstacle in lane.obstacles),
    )


def _mujoco_model(model: RobotModel, obstacles: tuple[Obstacle, ...]) -> Any:
    """Return the controller's own shapes in MuJoCo, each a geom of its name."""
    from handrail.collect import geometry
    from handrail.collect.gl import mujoco
    from handrail.collect.robot import build_robot

    bare = RobotModel(replace(model.description, gripper=None))
    spec = build_robot(bare, meshes=False).spec
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[8.0, 8.0, 0.1])
    for obstacle in obstacles:
        spec.worldbody.add_geom(
            name=obstacle.name,
            **geometry.geom_shape(obstacle.shape),
            **geometry.pose(obstacle.position, obstacle.rotation),
        )
    return spec.compile()

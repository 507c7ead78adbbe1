"""Differential inverse kinematics with collision avoidance (mink) as a controller."""

from dataclasses import replace
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.twist_completion import TwistController
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import imported
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle

_ACTIVATION_DISTANCE = 0.15  # beyond the margin, at which a pair enters the problem [m]
_BASE_COST, _ARM_COST = 0.0055, 0.01  # of velocities: the masked MPC's, square-rooted, relative to the tool's
_MARGIN = 0.10  # signed distance kept between shapes [m]
_APPROACH = 2.0  # how fast a distance may shrink, relative to what is left above the margin [1/s]
_SOLVERS = ("daqp", "proxqp", "quadprog")  # the fastest first; PIQP is slower than these and prints


class MinkController(TwistController):
    """One step of mink an update: the tool's twist, damped, inside limits, pairs kept apart; a controller.

    `min ‖J Δq − twist Δt‖² + ‖C Δq‖²` subject to velocity and position limits and, for every pair of shapes,
    `−Δd ≤ approach Δt (d − margin)`; then the limits of acceleration, which mink does not know, cut it.
    Without a solution the robot brakes.

    Args:
        model: of the robot.
        period: of the control loop [s].
    """

    def __init__(self, model: RobotModel, period: float = 0.05) -> None:
        wanted = "differential IK", "mink", "profile"
        self._mink, qpsolvers = (imported(name, *wanted) for name in ("mink", "qpsolvers"))
        self._solver = next(name for name in _SOLVERS if name in qpsolvers.available_solvers)
        super().__init__(model, self._velocity, period)

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the last command; build mink's tasks and limits for the scene of a new episode."""
        mink, model = self._mink, self._model
        around = tuple(obstacle for obstacle in obstacles if not obstacle.held)
        self._shapes = _shape_model(model, around)
        self._configuration = mink.Configuration(self._shapes)
        self._task = mink.FrameTask("tool", "site", position_cost=1.0, orientation_cost=1.0)
        costs = np.full(model.size, _ARM_COST)
        costs[: len(model.description.base.joints)] = _BASE_COST
        self._tasks = [self._task, mink.DampingTask(self._shapes, costs)]
        speeds = dict(zip(model.joints, model.description.limits.velocity.tolist(), strict=True))
        limits = [mink.ConfigurationLimit(self._shapes), mink.VelocityLimit(self._shapes, speeds)]
        self._limits = [*limits, *self._avoidance(around)]
        super().reset(obstacles)

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now; mink does not avoid what the hand holds."""
        super().update_scene(obstacles)
        for obstacle in obstacles:
            if not obstacle.held:
                self._shapes.geom(obstacle.name).pos[:] = obstacle.position

    def _avoidance(self, obstacles: tuple[Obstacle, ...]) -> list[Any]:
        """Return a limit for every margin that pairs keep: a few of the robot's own keep less.

        Mink's own filter would drop neighbours: base against obstacle, for one.
        """

        class EveryPair(self._mink.CollisionAvoidanceLimit):
            def _construct_geom_id_pairs(self, geom_pairs: Any) -> list[tuple[int, int]]:
                return [(self.model.geom(a).id, self.model.geom(b).id) for (a,), (b,) in geom_pairs]

        collision = CollisionModel(self._model, obstacles)
        margins = np.minimum(_MARGIN, collision.largest_margin)
        return [
            EveryPair(
                self._shapes,
                [([a], [b]) for (a, b), kept in zip(collision.pairs, margins, strict=True) if kept == margin],
                gain=min(_APPROACH * self._period, 1.0),
                minimum_distance_from_collisions=margin,
                collision_detection_distance=margin + _ACTIVATION_DISTANCE,
            )
            for margin in np.unique(margins).tolist()
        ]

    def _velocity(
        self, q: FloatArray, previous: FloatArray, twist: FloatArray, duration: float
    ) -> FloatArray:
        """Return mink's velocity, (n,); one that is not finite, and thus brakes, without a solution."""
        mink = self._mink
        self._configuration.update(q)
        now = self._configuration.get_transform_frame_to_world("tool", "site")
        turned = mink.SO3.exp(duration * twist[3:]) @ now.rotation()
        moved = now.translation() + duration * twist[:3]
        self._task.set_target(mink.SE3.from_rotation_and_translation(turned, moved))
        try:
            return mink.solve_ik(
                self._configuration, self._tasks, duration, self._solver, damping=1e-9, limits=self._limits
            )
        except (mink.MinkError, ValueError, RuntimeError):
            return np.full(len(q), np.nan)


def _shape_model(model: RobotModel, obstacles: tuple[Obstacle, ...]) -> Any:
    """Return the controller's own shapes in MuJoCo, each a geom of its name."""
    from handrail.collect.world import geometry
    from handrail.collect.world.robot import build_robot

    hands = tuple(replace(hand, gripper=None) for hand in model.description.hands)
    bare = RobotModel(replace(model.description, hands=hands))
    spec = build_robot(bare, meshes=False)
    for obstacle in obstacles:
        spec.worldbody.add_geom(
            name=obstacle.name,
            **geometry.geom_shape(obstacle.shape),
            **geometry.pose(obstacle.position, obstacle.rotation),
        )
    return spec.compile()

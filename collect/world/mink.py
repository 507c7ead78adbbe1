"""Differential inverse kinematics with collision avoidance (mink) as a controller."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.catalogue import ControllerSpec
from handrail.controllers.baselines.twist_completion import TwistController
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.errors import imported
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Obstacle

_ACTIVATION_DISTANCE = 0.15  # beyond the margin, at which a pair enters the problem [m]
_MARGIN, _WORK_MARGIN = 0.10, 0.008  # signed distances kept, as by the masked MPC, at scale 1 [m]
_SOLVERS = ("daqp", "proxqp", "quadprog")  # the fastest first; PIQP is slower than these and prints


@dataclass(frozen=True)
class MinkSettings:
    """Costs of mink's tasks beside the tool's 1: square roots of weights; chosen on seeds from 100 on."""

    base: float = 0.0055  # of the base's velocities
    arm: float = 0.01  # of the arm's
    posture: float = 0.0  # of the arm's way home
    approach: float = 2.0
    """Share of a distance above its margin that a step may take; mink 1.3 divides its gain by Δt."""


class MinkController(TwistController):
    """One step of mink an update: the tool's twist, damped, inside limits, pairs kept apart; a controller.

    `min ‖J Δq − twist Δt‖² + ‖C Δq‖² + c² ‖q_home − q − Δq‖²` subject to velocity and position limits and,
    for every pair of shapes, `−Δd ≤ approach (d − margin)`; then the limits of acceleration, which mink does
    not know, cut it. Without a solution the robot brakes. It follows neither that an obstacle turns nor how a
    held thing slipped.

    Args:
        model: of the robot.
        period: of the control loop [s].
        settings: costs.
    """

    def __init__(self, model: RobotModel, period: float = 0.05, settings: MinkSettings | None = None) -> None:
        wanted = "differential IK", "mink", "profile"
        self._mink, qpsolvers = (imported(name, *wanted) for name in ("mink", "qpsolvers"))
        self._solver = next(name for name in _SOLVERS if name in qpsolvers.available_solvers)
        self._settings, scale = settings or MinkSettings(), model.description.world.scale
        super().__init__(model, self._velocity, period, (scale * _MARGIN, scale * _WORK_MARGIN))

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the last command; take the scene of a new episode."""
        super().reset(obstacles)
        self._obstacles, self._built = obstacles, None

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now, and what the hand holds."""
        super().update_scene(obstacles)
        self._obstacles = obstacles

    def _build(self, around: Surroundings) -> None:
        """Build mink's tasks and limits for what stands around, and what the hand holds."""
        mink, model, settings = self._mink, self._model, self._settings
        self._built, self._shapes = around.collision, _shape_model(model, self._obstacles)
        self._configuration = mink.Configuration(self._shapes)
        self._task = mink.FrameTask(model.hand.named("tool"), "site", position_cost=1.0, orientation_cost=1.0)
        arm = np.arange(model.size) >= len(model.description.base.joints)
        self._tasks = [self._task, mink.DampingTask(self._shapes, np.where(arm, settings.arm, settings.base))]
        if settings.posture:
            home = mink.PostureTask(self._shapes, settings.posture * arm)
            home.set_target(model.description.home)
            self._tasks.append(home)
        speeds = dict(zip(model.joints, model.description.limits.velocity.tolist(), strict=True))
        limits = [mink.ConfigurationLimit(self._shapes), mink.VelocityLimit(self._shapes, speeds)]
        self._limits = [*limits, *self._avoidance(around)]

    def _avoidance(self, around: Surroundings) -> list[Any]:
        """Return a limit for every margin that pairs keep: a few of the robot's own keep less.

        Mink's own filter would drop neighbours: base against obstacle, for one.
        """

        class EveryPair(self._mink.CollisionAvoidanceLimit):
            def _construct_geom_id_pairs(self, geom_pairs: Any) -> list[tuple[int, int]]:
                return [(self.model.geom(a).id, self.model.geom(b).id) for (a,), (b,) in geom_pairs]

        pairs = list(zip(around.collision.pairs, around.margins.tolist(), strict=True))
        return [
            EveryPair(
                self._shapes,
                [([a], [b]) for (a, b), kept in pairs if kept == margin],
                gain=min(self._settings.approach * self._period, 1.0),
                minimum_distance_from_collisions=margin,
                collision_detection_distance=margin + _ACTIVATION_DISTANCE,
            )
            for margin in np.unique(around.margins).tolist()
        ]

    def _velocity(
        self, q: FloatArray, previous: FloatArray, twist: FloatArray, duration: float
    ) -> FloatArray:
        """Return mink's velocity, (n,); one that is not finite, and thus brakes, without a solution."""
        mink, around = self._mink, self.surroundings.known_at(q)
        if self._built is not around.collision:
            self._build(around)
        for obstacle in self._obstacles:
            if not obstacle.held:
                self._shapes.geom(obstacle.name).pos[:] = obstacle.position
        self._configuration.update(q)
        now = self._configuration.get_transform_frame_to_world(self._model.hand.named("tool"), "site")
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
        place, body = Pose(obstacle.position, obstacle.rotation), spec.worldbody
        if obstacle.held:
            tool = model.pinocchio.frames[model.frame_id(obstacle.frame)].placement
            body = spec.site(obstacle.frame).parent
            place = Pose(tool.act(obstacle.position), tool.rotation @ obstacle.rotation)
        body.add_geom(
            name=obstacle.name,
            mass=0.0,
            **geometry.geom_shape(obstacle.shape),
            **geometry.pose(place.position, place.rotation),
        )
    return spec.compile()


def whole_body_mink(model: RobotModel, period: float = 0.05) -> MinkController:
    """Return mink for an operator who steers the hand, with the masked MPC's own weights.

    Of nine settings on 20 scripted episodes each of `reach` and `pick_place` (seed 100) none did better by
    more than chance; those that may come nearer to shapes in a step touched something in 0 to 2.
    """
    return MinkController(model, period, MinkSettings(base=0.00316, posture=0.001, approach=0.25))


MINK = ControllerSpec(
    "mink", whole_body_mink, "whole-body inverse kinematics that keeps distances (mink)", protects=True
)

"""Differential inverse kinematics with collision avoidance (mink) as a controller."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from handrail.collect.experiments.mink.scene import (
    avoidance,
    import_mink,
    qp_solvers,
    shape_model,
    standing_pairs,
)
from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.twist_completion import twist_controller
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle


@dataclass(frozen=True)
class MinkSettings:
    """Settings of mink's tasks and limits; costs are those of the masked MPC's objectives, square-rooted.

    Attributes:
        base_cost: of base velocities, relative to the tool's.
        arm_cost: of arm velocities.
        margin: signed distance kept between shapes [m].
        activation_distance: distance beyond the margin at which a pair enters the problem [m].
        approach: how fast a distance may shrink, relative to what is left above the margin [1/s].
    """

    base_cost: float = 0.0055
    arm_cost: float = 0.01
    margin: float = 0.10
    activation_distance: float = 0.15
    approach: float = 2.0


class MinkController:
    """One step of mink an update: the tool's twist, damped, inside limits, pairs kept apart; a controller.

    `min ‖J Δq − twist Δt‖² + ‖C Δq‖²` subject to velocity and position limits and, for every pair of shapes,
    `−Δd ≤ approach Δt (d − margin)`; then the limits of acceleration, which mink does not know, cut it.
    Without a solution the robot brakes.

    Args:
        model: of the robot.
        period: of the control loop [s].
        settings: costs, margins.
        intent_timeout: age from which an intent is stale [s].

    Raises:
        HandrailError: mink is not installed.
    """

    def __init__(
        self,
        model: RobotModel,
        period: float = 0.05,
        settings: MinkSettings | None = None,
        intent_timeout: float = 0.25,
    ) -> None:
        self._mink = import_mink()
        self._solver = qp_solvers()[0]
        self._model, self._period = model, period
        self._settings = settings or MinkSettings()
        self._reactive = twist_controller(model, self._velocity, period, intent_timeout)
        self.reset()

    @property
    def channels(self) -> Channels:
        """The robot's command channels."""
        return self._reactive.channels

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the last command; build mink's tasks and limits for the scene of a new episode."""
        mink, settings = self._mink, self._settings
        around = tuple(obstacle for obstacle in obstacles if not obstacle.held)
        self._shapes = shape_model(self._model, around)
        self._configuration = mink.Configuration(self._shapes)
        self._task = mink.FrameTask("tool", "site", position_cost=1.0, orientation_cost=1.0)
        base = len(self._model.description.base_joints)
        costs = np.where(np.arange(self._model.size) < base, settings.base_cost, settings.arm_cost)
        self._tasks = [self._task, mink.DampingTask(self._shapes, costs)]
        speeds = dict(zip(self._model.joints, self._model.description.limits.velocity.tolist(), strict=True))
        limits = [mink.ConfigurationLimit(self._shapes), mink.VelocityLimit(self._shapes, speeds)]
        self._limits = [*limits, *self._avoidance(around)]
        self._reactive.reset(obstacles)

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now; mink does not avoid what the hand holds."""
        self._reactive.update_scene(obstacles)
        for obstacle in obstacles:
            if not obstacle.held:
                self._shapes.geom(obstacle.name).pos[:] = obstacle.position

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from now on."""
        return self._reactive.update(state, intent)

    def _avoidance(self, obstacles: tuple[Obstacle, ...]) -> list[Any]:
        """Return a limit for every margin that pairs keep: a few of the robot's own keep less."""
        description, settings = self._model.description, self._settings
        pairs = standing_pairs(self._model, obstacles)
        others = np.full(len(pairs) - len(description.self_margins), np.inf)
        margins = np.minimum(settings.margin, np.concatenate([description.self_margins, others]))
        gain = min(settings.approach * self._period, 1.0)
        return [
            avoidance(
                self._shapes,
                tuple(pair for pair, own in zip(pairs, margins, strict=True) if own == margin),
                margin,
                margin + settings.activation_distance,
                gain,
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

"""Direct joint teleoperation: the baseline that completes nothing."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.reactive import ReactiveController
from handrail.controllers.baselines.twist_completion import base_velocity
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle


class DirectController:
    """Sends the commanded joint velocities, clipped to position, velocity and acceleration limits.

    A base twist is the base's joints; what nobody commands brakes. Distances are measured and reported, not
    kept.

    Args:
        model: of the robot.
        period: time in which a commanded velocity is reached, one control period [s].
        intent_timeout: age from which an intent is stale [s].
    """

    def __init__(self, model: RobotModel, period: float = 0.05, intent_timeout: float = 0.25) -> None:
        self._reactive = ReactiveController(model, self._commanded, period, intent_timeout)

    @property
    def channels(self) -> Channels:
        """The robot's command channels."""
        return self._reactive.channels

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the last command; take the obstacles whose distance is reported."""
        self._reactive.reset(obstacles)

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now, and what the hand holds."""
        self._reactive.update_scene(obstacles)

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from now on; brakes when an input is invalid or stale."""
        return self._reactive.update(state, intent)

    def _commanded(self, state: State, intent: Intent, previous: FloatArray) -> FloatArray:
        """Return the commanded joint velocities, zero where nobody commands, (n,)."""
        joints = self.channels.joint_slice
        velocity = np.where(intent.mask[joints], intent.values[joints], 0.0)
        velocity[: len(self.channels.base)] += base_velocity(intent, self.channels, state.q)
        return velocity

"""Direct joint teleoperation: the baseline that completes nothing."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.reactive import ReactiveController
from handrail.controllers.baselines.twist_completion import base_velocity
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import RobotModel


class DirectController(ReactiveController):
    """Sends the commanded joint velocities, clipped to position, velocity and acceleration limits.

    A base twist is the base's joints; what nobody commands brakes. Distances are measured and reported, not
    kept.

    Args:
        model: of the robot.
        period: time in which a commanded velocity is reached, one control period [s].
    """

    def __init__(self, model: RobotModel, period: float = 0.05) -> None:
        super().__init__(model, self._commanded, period)
        self._foreign[self.channels.hands_slice] = True

    def _commanded(self, state: State, intent: Intent, previous: FloatArray) -> FloatArray:
        joints = self.channels.joint_slice
        velocity = np.where(intent.mask[joints], intent.values[joints], 0.0)
        velocity[: len(self.channels.base)] += base_velocity(intent, self.channels, state.q)
        return velocity

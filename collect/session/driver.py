"""Asks a controller at its own rate, and says what to send the robot at the robot's."""

import numpy as np

from handrail.collect.envs.env import HandrailEnv
from handrail.collect.session.rate import Rate
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import Controller, State
from handrail.controllers.interface.intent import Intent


class Driver:
    """Drives the robot of one episode: a command is followed until the controller is asked again.

    It tells the controller what there is to avoid: at the beginning, and while it moves or is held.

    Args:
        controller: is reset.
        env: in which an episode has begun.
        period: of the controller [s].
        step: with which it begins.

    Attributes:
        command: of the controller's last update.
    """

    command: Command

    def __init__(self, controller: Controller, env: HandrailEnv, period: float, step: int = 0) -> None:
        self._controller, self._env, self._rate = controller, env, Rate(period, step * env.period)
        self._moving, self._holding = bool(env.start.scene.movers), bool(env.world.held())
        self._asked = step
        controller.reset(env.world.obstacles())

    def drive(self, step: int, state: State, intent: Intent) -> bool:
        """Ask the controller if it is due at a step; return whether it was."""
        if not self._rate.due(step * self._env.period):
            return False
        self._observe()
        self.command = self._controller.update(state, intent)
        self._asked = step
        self._rate.take()
        return True

    def action(self, step: int) -> FloatArray:
        """Return what to send for a step: the velocities at its end, and the gripper, (n + 1,)."""
        time = (step + 1 - self._asked) * self._env.period
        return np.append(self.command.velocity(time), self.command.gripper)

    def _observe(self) -> None:
        """Say where things are now, if that can have changed."""
        before, self._holding = self._holding, bool(self._env.world.held())
        if self._moving or self._holding or before:
            self._controller.update_scene(self._env.world.obstacles())

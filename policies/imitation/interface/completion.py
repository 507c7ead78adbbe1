"""What completes the intents of a policy into the motion of the whole robot: its mode's own controller."""

from dataclasses import dataclass, replace

import numpy as np

from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_controller
from handrail.collect.world.observation import from_numbers
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.model import load_model
from handrail.controllers.typed import Name
from handrail.policies.imitation.interface.checkpoint import Fps
from handrail.policies.imitation.interface.interface import PolicyInterface


@dataclass(frozen=True)
class Completion:
    """What completes the intents of a policy."""

    robot: Name
    task: Name
    """The controller knows the objectives that it brings."""
    mode: Name
    """Teleop mode, whose controller it is."""
    fps: Fps
    """Intents a second [Hz]."""

    @property
    def is_installed(self) -> bool:
        """Whether all names are found again without importing what a file says."""
        return self.robot in ROBOTS and self.task in TASKS and self.mode in MODES


class CompletedRobot:
    """One robot and its controller; an environment of several has as many.

    Args:
        interface: what the policy reads and writes.
        by: what completes that; a name that would be imported is refused.
    """

    def __init__(self, interface: PolicyInterface, by: Completion) -> None:
        ROBOTS.admit(by.robot)
        TASKS.admit(by.task)
        MODES.admit(by.mode)
        model = load_model(by.robot)
        if Channels.of(model.description).names != interface.channels:
            raise HandrailError(f"completion of intents: expected the channels of {by.robot}, got others")
        self._interface, self._by, self._n = interface, by, model.size
        self._controller = build_controller(MODES.find(by.mode), model, by.fps, by.task)
        self._time, self._around = np.inf, b""

    def velocities(
        self, action: FloatArray, state: FloatArray, time: FloatArray, sent: FloatArray, around: FloatArray
    ) -> FloatArray:
        """Return velocities and gripper, (n + 1,); an episode begins where the time is not later.

        Args:
            action: of the policy, (a,); one that is not finite brakes.
            state: as recorded, (s,).
            time: of the episode, (1,) [s].
            sent: velocities that were sent last, (n,).
            around: the obstacles, as numbers.
        """
        now, n = float(time[0]), self._n
        if now <= self._time:
            self._controller.reset(from_numbers(around))
        elif around.tobytes() != self._around:
            self._controller.update_scene(from_numbers(around))
        self._time, self._around = now, around.tobytes()
        if np.all(np.isfinite(action)):
            intent = self._interface.decode(action, state)
        else:
            size = len(self._interface.channels)
            intent = Intent(np.full(size, np.nan), np.ones(size, bool))
        command = self._controller.update(
            State(state[:n], state[n : 2 * n], now, sent), replace(intent, mode=self._by.mode, time=now)
        )
        return np.append(command.velocity(1.0 / self._by.fps), command.gripper)

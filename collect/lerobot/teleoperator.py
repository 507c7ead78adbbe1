"""What Handrail's teleoperators share: they see and steer the simulated robot of this process."""

from abc import abstractmethod
from dataclasses import replace
from typing import Any

import numpy as np
from lerobot.teleoperators import Teleoperator

from handrail.collect.lerobot.mode_action import AGAIN, HOLD, NEXT
from handrail.collect.lerobot.sim import HandrailSim, Uncalibrated, newest_robot
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.operators.person.person import Phase
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.intent import Intent

_BUTTONS = {
    EpisodeEvent.SUCCESS: NEXT,
    EpisodeEvent.FAILURE: NEXT,
    EpisodeEvent.DISCARD: NEXT,
    EpisodeEvent.RESTART: AGAIN,
}


class SimTeleoperator(Uncalibrated, Teleoperator):
    """A teleoperator of `handrail_sim`; another kind makes its operator.

    It looks on while a policy drives: a page stays alive, a script knows what is done, and what people say of
    the scene, or their e-stop, counts. When they take over, a gripper stays as it is until they change it.

    Args:
        config: its settings; `checked()` returns what they say, checked.
    """

    is_person = True
    """Whether the operator is somebody who is shown what happens, and whose device is given back."""
    _operator: Any = None

    def __init__(self, config: Any) -> None:
        self._settings = config.checked()
        super().__init__(config)

    @property
    def robot(self) -> HandrailSim:
        """The robot that it steers: the one of this process that was made last."""
        if robot := newest_robot():
            return robot
        raise HandrailError(
            f"--teleop.type={self.name}: expected --robot.type=handrail_sim, which it sees and steers; "
            "there is no such robot in this process"
        )

    @property
    def action_features(self) -> dict[str, type]:
        """Names of the numbers of an action."""
        return dict.fromkeys(self.robot.action.names, float)

    @property
    def feedback_features(self) -> dict[str, type]:
        """The same, of which none moves it: a velocity begins at rest, wherever the robot is.

        With these LeRobot lets the robot rest when a person takes over. Without, it would send a mixture of
        the policy's last velocity and the person's for a second.
        """
        return self.action_features

    @property
    def is_connected(self) -> bool:
        """Whether it steers."""
        return self._operator is not None

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Brake, for a period of the robot's: LeRobot hands over, and asks nobody else meanwhile."""
        self.robot.send_action(self.robot.action.still(self.robot.grippers) | {HOLD: 1.0})

    def enable_torque(self) -> None:
        """Do nothing: there is no motor."""

    def disable_torque(self) -> None:
        """Do nothing."""

    def connect(self, calibrate: bool = True) -> None:
        """Begin to steer."""
        self._operator, self._begun = self._made(self.robot), 0
        self._steers = self._has_watched = False
        self._turned: list[bool] | None = None
        self.robot.watch = self._watch

    def disconnect(self) -> None:
        """Steer no more."""
        operator, self._operator = self._operator, None
        if self.is_person and operator is not None:
            operator.close()

    def get_action(self) -> dict[str, Any]:
        """Return what the robot shall do now: the mode's channels, and a button if one is pressed."""
        if self._operator is None:
            raise HandrailError(f"{self.name}: expected connect() before anything else")
        robot, self._steers = self.robot, True
        asked = self._pressed(robot) or self._asked(robot)
        if isinstance(asked, EpisodeEvent):
            asked = _BUTTONS.get(asked, HOLD)
        if isinstance(asked, str):
            return robot.action.still(robot.grippers) | {asked: 1.0}
        if self.is_person:
            asked = self._as_gripped(asked, robot)
        return robot.action.action(asked, [tool.rotation for tool in robot.view.task.tools])

    def _asked(self, robot: HandrailSim) -> Intent | EpisodeEvent:
        """Return what the operator wants now, shown what has happened."""
        if robot.episodes != self._begun:
            if self.is_person:
                self._operator.begin(robot.env, robot.seed)
            self._operator.reset(robot.view, np.random.default_rng([robot.seed, 1]))
            self._begun, self._turned = robot.episodes, [False] * len(robot.grippers)
        elif self.is_person and robot.frame is not None:
            self._operator.see(robot.frame)
        return self._operator.act(robot.view)

    def _watch(self, paused: bool) -> str:
        """Look on, unless it was asked for this very action; return the button that is pressed, or ""."""
        steers, self._steers = self._steers, False
        if steers or self._operator is None:
            return ""
        self._has_watched = True
        robot = self.robot
        if not self.is_person and paused:  # a script knows no pause
            return NEXT if robot.loop.now.success else ""
        asked, self._turned = self._asked(robot), None
        if not isinstance(asked, EpisodeEvent):
            return ""
        stopped = self._operator.person.phase is Phase.STOPPED
        return _BUTTONS.get(asked, HOLD if stopped else "")

    def _as_gripped(self, asked: Intent, robot: HandrailSim) -> Intent:
        """Return a person's intent; a gripper stays as it was when they took over until they change it."""
        if self._turned is None:
            both = zip(asked.grippers, robot.grippers, strict=True)
            self._turned = [round(level) != round(now) for level, now in both]
        levels = zip(asked.grippers, self._turned, strict=True)
        return replace(asked, grippers=tuple(abs(turned - level) for level, turned in levels))

    @abstractmethod
    def _made(self, robot: HandrailSim) -> Any:
        """Return the operator of a robot."""

    def _pressed(self, robot: HandrailSim) -> str:
        """Return the button that is pressed whatever the operator says; "" if none."""
        return ""

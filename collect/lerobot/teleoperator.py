"""What Handrail's teleoperators share: they see and steer the simulated robot of this process."""

from abc import abstractmethod
from typing import Any

import numpy as np
from lerobot.teleoperators import Teleoperator

from handrail.collect.lerobot.mode_action import AGAIN, HOLD, NEXT
from handrail.collect.lerobot.sim import HandrailSim, Uncalibrated, newest_robot
from handrail.collect.operators.operator import EpisodeEvent
from handrail.controllers.errors import HandrailError

_BUTTONS = {
    EpisodeEvent.SUCCESS: NEXT,
    EpisodeEvent.FAILURE: NEXT,
    EpisodeEvent.DISCARD: NEXT,
    EpisodeEvent.RESTART: AGAIN,
}


class SimTeleoperator(Uncalibrated, Teleoperator):
    """A teleoperator of `handrail_sim`; another kind makes its operator.

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
        """There is none."""
        return {}

    @property
    def is_connected(self) -> bool:
        """Whether it steers."""
        return self._operator is not None

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Take no note of anything."""

    def connect(self, calibrate: bool = True) -> None:
        """Begin to steer."""
        self._operator, self._begun = self._made(self.robot), 0

    def disconnect(self) -> None:
        """Steer no more."""
        operator, self._operator = self._operator, None
        if self.is_person and operator is not None:
            operator.close()

    def get_action(self) -> dict[str, Any]:
        """Return what the robot shall do now: the mode's channels, and a button if one is pressed."""
        if self._operator is None:
            raise HandrailError(f"{self.name}: expected connect() before anything else")
        robot = self.robot
        if button := self._pressed(robot):
            return robot.action.still(robot.grippers) | {button: 1.0}
        view = robot.view
        if robot.episodes != self._begun:
            if self.is_person:
                self._operator.begin(robot.env, robot.seed)
            self._operator.reset(view, np.random.default_rng([robot.seed, 1]))
            self._begun = robot.episodes
        elif self.is_person and robot.frame is not None:
            self._operator.see(robot.frame)
        asked = self._operator.act(view)
        if isinstance(asked, EpisodeEvent):
            return robot.action.still(robot.grippers) | {_BUTTONS.get(asked, HOLD): 1.0}
        return robot.action.action(asked, [tool.rotation for tool in view.task.tools])

    @abstractmethod
    def _made(self, robot: HandrailSim) -> Any:
        """Return the operator of a robot."""

    def _pressed(self, robot: HandrailSim) -> str:
        """Return the button that is pressed whatever the operator says; "" if none."""
        return ""

"""What Handrail's teleoperators share: they steer the simulated robot of this process."""

from abc import abstractmethod
from typing import Any

from lerobot.teleoperators import Teleoperator, TeleoperatorConfig

from handrail.collect.lerobot.link import simulated_robot
from handrail.collect.lerobot.stepwise import Stepwise
from handrail.controllers.errors import HandrailError


class SimTeleoperator(Teleoperator):
    """A teleoperator of `handrail_sim`; another kind says what is to be done now."""

    def __init__(self, config: TeleoperatorConfig) -> None:
        self._connected = False
        super().__init__(config)

    @property
    def session(self) -> Stepwise:
        """The session of the robot that it steers."""
        return simulated_robot(self.name).stepwise

    @property
    def action_features(self) -> dict[str, type]:
        """Names of the numbers of an action."""
        return dict.fromkeys(self.session.action.names, float)

    @property
    def feedback_features(self) -> dict[str, type]:
        """There is none."""
        return {}

    @property
    def is_connected(self) -> bool:
        """Whether it steers."""
        return self._connected

    @property
    def is_calibrated(self) -> bool:
        """Nothing is to be calibrated."""
        return True

    def calibrate(self) -> None:
        """Do nothing."""

    def configure(self) -> None:
        """Do nothing."""

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Take no note of anything."""

    def connect(self, calibrate: bool = True) -> None:
        """Begin to steer."""
        self._open(self.session)
        self._connected = True

    def disconnect(self) -> None:
        """Steer no more."""
        self._connected = False
        self._close()

    def get_action(self) -> dict[str, Any]:
        """Return what the robot shall do now: the mode's channels, and a button if one is pressed."""
        if not self._connected:
            raise HandrailError(f"{self.name}: expected connect() before anything else")
        return self._act(self.session)

    @abstractmethod
    def _open(self, session: Stepwise) -> None: ...

    @abstractmethod
    def _act(self, session: Stepwise) -> dict[str, float]: ...

    def _close(self) -> None:
        """Give back what was opened."""

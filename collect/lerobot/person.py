"""People as LeRobot's `Teleoperator`s: at a browser, or with a gamepad.

LeRobot has one action for all time, so the teleop mode stays. What a person says of an episode becomes a
button: after success, failure or throwing it away comes another scene, after beginning again the same one.
While they do not steer, the robot brakes and time stands still. LeRobot's own keys save and repeat episodes.
"""

import webbrowser
from abc import abstractmethod
from dataclasses import fields
from typing import Any

import numpy as np

from handrail.collect.cockpit.cockpit import Cockpit, check_installed
from handrail.collect.cockpit.process import ServerProcess
from handrail.collect.config import RecordConfig, SessionConfig
from handrail.collect.devices.open_devices import open_gamepad
from handrail.collect.lerobot.configs import HandrailCockpitConfig, HandrailGamepadConfig
from handrail.collect.lerobot.mode_action import AGAIN, HOLD, NEXT
from handrail.collect.lerobot.stepwise import Stepwise
from handrail.collect.lerobot.teleoperator import SimTeleoperator
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.teleop_config import TeleopConfig
from handrail.datasets.presentation.terminal import Terminal

_BUTTONS = {
    EpisodeEvent.SUCCESS: NEXT,
    EpisodeEvent.FAILURE: NEXT,
    EpisodeEvent.DISCARD: NEXT,
    EpisodeEvent.RESTART: AGAIN,
}
_REFUSED = ("mode", "mask", "lock", "practice", "undo", "quit")  # LeRobot's loop has none of them


class _PersonTeleoperator(SimTeleoperator):
    """Whoever steers by hand; another kind opens their device."""

    _person: Any = None

    def _open(self, session: Stepwise) -> None:
        session.env.render_mode = "rgb_array"  # from the next episode on the robot looks as it does
        self._person, self._begun = self._opened(session), 0

    @abstractmethod
    def _opened(self, session: Stepwise) -> Any: ...

    def _act(self, session: Stepwise) -> dict[str, float]:
        person, view = self._person, session.view
        if session.episodes != self._begun:
            person.begin(session.env, session.seed)
            person.reset(view, np.random.default_rng([session.seed, 1]))
            self._begun = session.episodes
        elif session.frame is not None:
            person.see(session.frame)
        asked = person.act(view)
        if isinstance(asked, EpisodeEvent):
            return session.action.still(session.gripper) | {_BUTTONS.get(asked, HOLD): 1.0}
        return session.action.action(asked, view.tool.rotation)

    def _close(self) -> None:
        if self._person is not None:
            self._person.close()
        self._person = None


class HandrailCockpit(_PersonTeleoperator):
    """A person at a browser steers `handrail_sim`.

    Args:
        config: its settings.
    """

    config_class = HandrailCockpitConfig
    name = "handrail_cockpit"

    def __init__(self, config: HandrailCockpitConfig) -> None:
        self._settings = config.cockpit()
        super().__init__(config)

    @property
    def address(self) -> str:
        """Of the page, once it is connected."""
        return self._server.address

    def _opened(self, session: Stepwise) -> Cockpit:
        check_installed()
        say = Terminal().print
        self._server = ServerProcess(self._settings, say)
        say(f"Drive at {self.address}")
        if self._settings.opens:
            webbrowser.open(self.address)
        mode = session.mode
        modes = {mode.name: mode}
        return Cockpit(session.env.model, modes, mode.name, self._server, refuses=_REFUSED, say=say)


class HandrailGamepad(_PersonTeleoperator):
    """A person with a gamepad steers `handrail_sim`.

    Args:
        config: its settings.
    """

    config_class = HandrailGamepadConfig
    name = "handrail_gamepad"

    def __init__(self, config: HandrailGamepadConfig) -> None:
        self._settings = config.teleop()
        super().__init__(config)

    def _opened(self, session: Stepwise) -> Any:
        config = _recording(session.config, self._settings)
        mode = session.mode
        return open_gamepad(config, session.env, print, {mode.name: mode})


def _recording(config: SessionConfig, teleop: TeleopConfig) -> RecordConfig:
    """Return the settings of a recording with those of a session."""
    said = {each.name: getattr(config, each.name) for each in fields(SessionConfig)}
    return RecordConfig(**said, teleop=teleop)

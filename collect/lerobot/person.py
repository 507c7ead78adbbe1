"""People as LeRobot's `Teleoperator`s: at a browser, or with a gamepad.

LeRobot has one action for all time, so the teleop mode stays. A person's word on an episode becomes a
button: after success, failure or throwing it away comes another scene, after beginning again the same one.
While they do not steer, the robot brakes and time stands still. LeRobot's own keys save and repeat episodes.
"""

from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from typing import Any

from handrail.collect.cockpit.cockpit import NEEDED, Cockpit
from handrail.collect.cockpit.process import open_server
from handrail.collect.config import RecordConfig, SessionConfig
from handrail.collect.devices.open_devices import open_device
from handrail.collect.lerobot.configs import HandrailCockpitConfig, HandrailGamepadConfig
from handrail.collect.lerobot.sim import HandrailSim
from handrail.collect.lerobot.teleoperator import SimTeleoperator
from handrail.collect.operators.person.meaning import HAND_FRAMES
from handrail.collect.operators.person.person import Person
from handrail.controllers.errors import check_installed
from handrail.datasets.presentation.terminal import Terminal

_REFUSED = ("mode", "mask", "hand", "lock", "practice", "undo", "quit")  # LeRobot's loop has none of them


class HandrailCockpit(SimTeleoperator):
    """A person at a browser steers `handrail_sim`."""

    config_class = HandrailCockpitConfig
    name = "handrail_cockpit"

    def _made(self, robot: HandrailSim) -> Cockpit:
        check_installed(*NEEDED)
        robot.env.render_mode = "rgb_array"  # from the next episode on the robot looks as it does
        mode, say = robot.mode, Terminal().print
        server = open_server(self._settings, say)
        person = Person(robot.env.model, {mode.name: mode}, mode.name)
        _keep_to_sayable_frames(person, robot, say)
        return Cockpit(person, server, _REFUSED, say)


class HandrailGamepad(SimTeleoperator):
    """A person with a gamepad steers `handrail_sim`."""

    config_class = HandrailGamepadConfig
    name = "handrail_gamepad"

    def _made(self, robot: HandrailSim) -> Any:
        robot.env.render_mode = "rgb_array"
        said = {each.name: getattr(robot.session, each.name) for each in fields(SessionConfig)}
        config = replace(RecordConfig(**said, teleop=self._settings), operator="gamepad")
        owned = partial(robot.mode.owned, hand=robot.env.model.hand.name)
        mode = replace(robot.mode, groups=owned)  # whichever hand is chosen, its action is of this one
        made = open_device(config, robot.env, print, {mode.name: mode}, with_keys=False)  # LeRobot reads them
        _keep_to_sayable_frames(made.person, robot, print)
        return made


def _keep_to_sayable_frames(person: Person, robot: HandrailSim, say: Callable[[str], None]) -> None:
    """Leave the tool's frame out, and say so, where an action cannot say a twist in its axes."""
    if not robot.action.turns:
        person.frames = tuple(frame for frame in HAND_FRAMES if frame != "tool")
        say(f"mode {robot.mode.name} has only some of a hand's axes: it is not steered in the tool's frame")

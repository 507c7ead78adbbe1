"""A person at this computer, with a device in hand: an operator, an observer, a card in the terminal."""

import numpy as np
from rich.console import RenderableType

from handrail.collect.devices.card import Card
from handrail.collect.devices.control_map import Moves
from handrail.collect.devices.device import DeviceInput
from handrail.collect.devices.device_reader import DeviceReader
from handrail.collect.devices.follower import Follower
from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.person.inputs import ASKS, Ask, Input
from handrail.collect.operators.person.person import Person, Phase
from handrail.collect.session.outcome import Outcome
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.interface.intent import Intent
from handrail.datasets.recording.frames import Frame

FRAMES = ("base", "tool", "world")  # of the hand; there is no page that looks from somewhere
_STEP, _LEAST = 0.2, 0.2  # of the speed


def choice_of(action: str, person: Person) -> Ask | None:
    """Return what an action asks for now; None where it asks nothing of the person."""
    setting, phase, now = person.setting, person.phase, person.setting.speed
    match action:
        case "start" | "start_or_pause" if phase is Phase.STOPPED:
            return Ask("stop", False)  # after the e-stop, first its release
        case "start_or_pause":
            return Ask("pause" if phase in (Phase.DRIVING, Phase.LOST) else "start")
        case "mode" | "mode_back":
            names = list(person.modes)
            at = names.index(setting.mode.name) if setting.mode.name in names else 0
            return Ask("mode", names[(at + (1 if action == "mode" else -1)) % len(names)])
        case "speed":
            return Ask("speed", _LEAST if now > 1.0 - _STEP / 2 else round(now + _STEP, 1))
        case "faster" | "slower":
            step = _STEP if action == "faster" else -_STEP
            return Ask("speed", round(min(1.0, max(_LEAST, now + step)), 1))
        case "frame":
            at = FRAMES.index(setting.frame) if setting.frame in FRAMES else -1
            return Ask("frame", FRAMES[(at + 1) % len(FRAMES)])
        case "focus":
            return Ask("focus", "hand" if setting.focus == "base" else "base")
        case "practice":
            return Ask("practice", not person.practises)
    return Ask(action) if action in ASKS else None


class LocalPerson:
    """Steers by the devices in hand.

    Args:
        person: whose inputs they are.
        main: the device that the operator is named after.
        beside: another one, such as the terminal's keys.
        follower: of a leader arm, which is then the main device; the other one has the clutch and the base.
        card: shows how it stands.
    """

    def __init__(
        self,
        person: Person,
        main: DeviceReader,
        beside: DeviceReader | None,
        follower: Follower | None,
        card: Card,
    ) -> None:
        self._person, self._main, self._beside = person, main, beside
        self._follower, self._card = follower, card
        self._grip = False

    def __rich__(self) -> RenderableType:
        """Return what the terminal shows."""
        return self._card

    @property
    def practises(self) -> bool:
        """Whether the episode is not to be saved."""
        return self._person.practises

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Show the task of a new episode."""
        self._card.begin(env.task.description, env.task.horizon)

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode: the robot waits for the operator."""
        self._grip = False
        self._person.reset(view, rng)

    def act(self, view: View) -> Intent | EpisodeEvent:
        """Return the intent now, or what becomes of the episode."""
        main = self._main.input(self._banks(self._main))
        beside = self._beside.input(self._banks(self._beside)) if self._beside else None
        for heard in (main, beside):
            for action in heard.presses if heard else ():
                self._do(action)
        self._take(main, beside, view)
        answer = self._person.act(view)
        moving = self._beside if self._follower and self._beside else self._main
        moves = moving.bank(self._banks(moving))
        apart = self._follower.apart(main.joints, view.state.q) if self._follower and main else None
        self._card.show(view, self._person, moves, self._trouble, self._grip, apart)
        return answer

    def see(self, frame: Frame) -> None:
        """Take note of how the controller fared."""
        self._card.see(frame.diagnostics.status)

    def end(self, outcome: Outcome) -> None:
        """Take note that an episode is over."""
        self._card.say("saved" if outcome.kept else "not saved")

    def close(self) -> None:
        """Give the devices back."""
        for source in filter(None, (self._main, self._beside)):
            source.close()

    def _banks(self, source: DeviceReader) -> list[Moves]:
        """Return the banks of a device for what is steered now."""
        meaning = self._person.meaning
        channels, mask = meaning.channels, meaning.mask(self._person.setting)
        base = len(channels.base)
        joints = mask[channels.joint_slice]
        arm = tuple(name for name, owned in zip(channels.joints[base:], joints[base:], strict=True) if owned)
        drives = bool(mask[channels.base_slice].any() or (base and joints[:base].all()))
        return source.controls.banks(bool(mask[channels.tool_slice].any()), drives, arm)

    def _take(self, main: DeviceInput | None, beside: DeviceInput | None, view: View) -> None:
        """Tell the person where the inputs are; that nobody drives, while a device that is needed is gone."""
        other = beside if self._follower else main
        if main is None or other is None:
            self._person.lose()
            return
        on, axes, targets = main.attended and "hold" in main.holds, main.deflections, ()
        if self._follower:
            on = main.attended and other.attended
            targets = self._follower.targets(main.joints, on and "clutch" in other.holds, view.state.q)
            self._grip, axes = self._follower.grips(main.joints, self._grip), other.deflections
        values = tuple(
            float(np.clip(axes.get(name, 0.0), -1.0, 1.0)) for name in self._person.meaning.channels.names
        )
        inputs = Input(on, self._main.device.name, self._grip, values, targets=targets)
        self._person.take(inputs, min(main.time, other.time), max(main.round_trip, other.round_trip))

    @property
    def _trouble(self) -> str:
        return self._main.trouble or (self._beside.trouble if self._beside and self._follower else "")

    def _do(self, action: str) -> None:
        """Do what a control asks for."""
        if action == "grip":
            self._grip = not self._grip
        elif action == "help":
            self._card.turn_over()
        elif action == "focus":  # after the last bank comes the other focus, where the mode has one
            if self._main.next_bank(self._banks(self._main)) and self._person.setting.mode.by_focus:
                self._ask(action)
        else:
            self._ask(action)

    def _ask(self, action: str) -> None:
        if (ask := choice_of(action, self._person)) is not None:
            self._person.ask(ask)

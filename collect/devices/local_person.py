"""A person at this computer, with a device in hand: an operator, an observer, a card in the terminal."""

import numpy as np
from rich.console import RenderableType

from handrail.collect.devices.card import Card
from handrail.collect.devices.control_map import CLUTCH, HOLD, Steered
from handrail.collect.devices.device import DeviceInput
from handrail.collect.devices.device_reader import DeviceReader
from handrail.collect.devices.follower import Follower
from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.person.inputs import ASKS, STILLS, Ask, Input
from handrail.collect.operators.person.person import Person, Phase
from handrail.collect.session.outcome import Outcome
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.interface.command import Status
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
            frames = [frame for frame in FRAMES if frame in person.frames]
            at = frames.index(setting.frame) if setting.frame in frames else -1
            return Ask("frame", frames[(at + 1) % len(frames)])
        case "focus":
            focus = "hand" if setting.focus == "base" else "base"
            return Ask("focus", focus) if setting.mode.by_focus else None
        case "hand":
            hands = person.meaning.hands
            return Ask("hand", hands[(hands.index(setting.hand) + 1) % len(hands)])
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
        shared: whether a policy moves the grippers too.

    Attributes:
        person: who steers.
    """

    def __init__(
        self,
        person: Person,
        main: DeviceReader,
        beside: DeviceReader | None = None,
        follower: Follower | None = None,
        shared: bool = False,
    ) -> None:
        self.person, self._main, self._follower, self._shared = person, main, follower, shared
        self._sources = [main, beside] if beside else [main]
        self._moving = self._sources[-1] if follower else main  # the one with the dead-man
        self._card = Card(person, main.device.name, [source.controls for source in self._sources])
        self._handle: bool | None = None  # whether a leader's is closed, once it has said so

    def __rich__(self) -> RenderableType:
        """Return what the terminal shows."""
        return self._card

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Show the task of a new episode."""
        self._card.task, self._card.time_limit = env.task.description, env.task.time_limit

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode: the robot waits for the operator; what was pressed is over, STOP is not."""
        self.person.over()
        self._heard()
        self._handle, self._card.brakes = None, ""
        self.person.reset(view, rng)

    def act(self, view: View) -> Intent | EpisodeEvent:
        """Return the intent now, or what becomes of the episode."""
        self._take(*self._heard(), view)
        answer, card = self.person.act(view), self._card
        card.view, card.moves, card.grips = view, self._moving.moves(self._steered), self._closed(view)
        return answer

    def between(self) -> EpisodeEvent | None:
        """Return what holds before an episode begins: QUIT; PAUSE in the e-stop, or if a device is gone."""
        self.person.over()
        gone = None in self._heard()
        return self.person.between or (EpisodeEvent.PAUSE if gone else None)

    def see(self, frame: Frame) -> None:
        """Take note of how the controller fared."""
        status = Status(frame.diagnostics.status)
        self._card.brakes = status.value.replace("_", " ") if status.brakes else ""

    def end(self, outcome: Outcome) -> None:
        """Take note that an episode is over."""
        self._card.before = "saved" if outcome.kept else "not saved"

    def close(self) -> None:
        """Give the devices back."""
        for source in self._sources:
            source.close()

    def _heard(self) -> tuple[DeviceInput | None, DeviceInput | None]:
        """Do what was pressed, STOP first; return the input of the main device, and of the dead-man's."""
        said = {source: source.input(self._steered) for source in self._sources}
        asked = [action for _, actions in said.values() for action in actions]
        if "stop" in asked:  # what is heard with it may have been pressed before it
            asked = ["stop", *(each for each in asked if each in STILLS)]
        for action in asked:
            self._do(action)
        self._card.trouble = self._main.trouble or self._moving.trouble
        return said[self._main][0], said[self._moving][0]

    @property
    def _steered(self) -> Steered:
        meaning = self.person.meaning
        channels, mask = meaning.channels, meaning.mask(self.person.setting)
        base = len(channels.base)
        joints = mask[channels.joint_slice]
        arm = tuple(name for name, owned in zip(channels.joints[base:], joints[base:], strict=True) if owned)
        drives = bool(mask[channels.base_slice].any() or (base and joints[:base].all()))
        parts, pair = meaning.parts(self.person.setting), mask[channels.pair_slice]
        return Steered(bool(parts), drives, arm, "two" in parts, bool(pair[6:].any()))

    def _take(self, main: DeviceInput | None, other: DeviceInput | None, view: View) -> None:
        """Tell the person where the inputs are; that nobody drives, while a device that is needed is gone.

        Args:
            main: of the device that the operator is named after.
            other: of the one with the dead-man.
            view: what there is to see.
        """
        if main is None or other is None or (self._follower and not main.joints):
            self._card.apart = None
            self.person.lose()
            return
        on, targets = main.attended and other.attended, ()
        if self._follower:
            clutch = on and CLUTCH in other.deflections
            targets = self._follower.targets(main.joints, clutch, view.state.q)
            handle, said = self._follower.grips(main.joints, bool(self._handle)), self._handle is not None
            if said and self._shared and self.person.phase is not Phase.DRIVING:
                handle = self._handle  # how it stands is looked at when they go on
            if said and handle not in (self._handle, self._closed(view)[0] > 0.5):
                self.person.grip(0)
            self._handle = handle
            self._card.apart = self._follower.apart(main.joints, view.state.q)
        else:
            on = on and HOLD in main.deflections
        said, names = dict[str, float](), self.person.meaning.channels.names
        parts = self.person.meaning.parts(self.person.setting)
        for axis, value in other.deflections.items():
            part, _, way = axis.partition(".")
            name = f"{parts[part]}.{way}" if part in parts else axis
            said[name] = said.get(name, 0.0) + value
        axes = tuple(float(np.clip(said.get(name, 0.0), -1.0, 1.0)) for name in names)
        inputs = Input(on, self._main.device.name, (False,) * len(self.person.closed), axes, 0.0, targets)
        self.person.take(inputs, min(main.time, other.time), max(main.round_trip, other.round_trip))

    def _closed(self, view: View) -> tuple[float, ...]:
        """Return how far each gripper shall be closed: beside a policy as was sent, which may be its wish."""
        return view.grippers if self._shared and view.grippers else tuple(self.person.closed)

    def _do(self, action: str) -> None:
        """Do what a control asks for."""
        hands = self.person.meaning.hands
        grips = {"grip": hands.index(self.person.setting.hand), "grip_left": 0, "grip_right": len(hands) - 1}
        if action in grips:
            self.person.grip(grips[action])
        elif action == "help":
            self._card.is_helping = not self._card.is_helping
        elif action == "focus" and not self._main.next_bank(self._steered):
            return  # after the last bank comes the other focus
        elif ask := choice_of(action, self.person):
            self.person.ask(ask)

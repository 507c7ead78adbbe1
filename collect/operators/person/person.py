"""A person, as an operator: the newest input steers; anything doubtful brakes and pauses.

```
ready ─ start ─▶ driving ◀─ start ─ paused        stopped: the e-stop, until it is released
                   │  ▲                      ▲
   input old, dead-│  │ everything was       │ the device is gone, or drives no more
     man let go    ▼  │ let go once ─────────┘
                   lost
```
A stop that is released leads back to `ready` where the episode has not begun yet.
In every state but `driving` the robot brakes to rest and nothing is recorded.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from enum import StrEnum
from typing import Any

import numpy as np

from handrail.collect.clock import time_with_sleep
from handrail.collect.operators.modes import TeleopMode, mode_of_mask
from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.person.inputs import STILLS, Ask, Input
from handrail.collect.operators.person.meaning import HAND_FRAMES, InputMeaning, Setting
from handrail.controllers.interface.intent import DEAD_MAN_TIME, Intent
from handrail.controllers.robot.model import RobotModel

_EVENTS = {what: EpisodeEvent(what) for what in STILLS - {"pause"}}


class Phase(StrEnum):
    """Where an episode stands."""

    READY = "ready"
    DRIVING = "driving"
    PAUSED = "paused"
    LOST = "lost"
    STOPPED = "stopped"


class Person:
    """Steers by what a device says: a page, a gamepad, a leader arm.

    Args:
        model: of the robot.
        modes: that one can change to, by name.
        first: the mode at the beginning.
        clock: of inputs [s].
        supervises: whether something else moves the robot while all is let go, and no dead-man is held: then
            what was lost is paused, and goes on with Start alone.

    Attributes:
        frames: in which the hand may be steered.
        setting: what the operator has chosen.
        phase: where the episode stands.
        practises: whether the episode is not to be saved.
        inputs: the newest.
        received: when they came [s].
        round_trip: of the frame that they answer [s].
        again: what of `Setting` every episode begins with; else it goes on as it was.
        closed: how far each gripper shall be, 0 open to 1 closed: as it is until it is changed.
    """

    def __init__(
        self,
        model: RobotModel,
        modes: Mapping[str, TeleopMode],
        first: str,
        clock: Callable[[], float] = time.monotonic,
        supervises: bool = False,
    ) -> None:
        self._lost = Phase.PAUSED if supervises else Phase.LOST
        self.meaning = InputMeaning(model)
        self.modes, self._clock = modes, clock
        self.frames: tuple[str, ...] = HAND_FRAMES
        self.setting, self.phase = Setting(modes[first], hand=model.hand.name), Phase.READY
        self.inputs: Input | None = None
        self.received = self.round_trip = 0.0
        self.closed = [0.0] * len(self.meaning.hands)
        self._grips: tuple[bool, ...] = ()  # the device's, as it said last: a change changes a gripper
        self._undone = False
        self.practises = False
        self._event: EpisodeEvent | None = None
        self._quits = False  # once the episode that was judged is saved
        self.again: Mapping[str, Any] = {}
        self._armed = False  # everything was let go once since the robot had to brake
        self._begun = False  # somebody has driven in this episode
        self._slept = _slept()  # so far, as is known [s]

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode: the robot waits for the operator."""
        self.over()
        self._find(view)

    def over(self) -> None:
        """Take note that the episode before is over: what is asked from now on is not of it."""
        self.setting = replace(self.setting, **self.again, axis=-1, switches=0)
        self.phase = Phase.STOPPED if self.phase is Phase.STOPPED else Phase.READY
        quits = self.between is EpisodeEvent.QUIT
        self._event, self._quits = EpisodeEvent.QUIT if quits else None, False
        self._armed = self._begun = False

    def take(self, inputs: Input, received: float, round_trip: float = 0.0) -> None:
        """Take where the inputs are now.

        Args:
            inputs: of the device that drives.
            received: when they came, on the operator's clock [s].
            round_trip: of the frame that they answer [s].
        """
        if not self.meaning.fits(inputs):
            return
        for hand, (now, before) in enumerate(zip(inputs.grips, self._grips, strict=False)):
            if now != before:
                self.grip(hand)
        self._grips = inputs.grips
        self.inputs, self.received, self.round_trip = inputs, received, round_trip
        self._armed |= inputs.on and inputs.is_let_go

    def lose(self) -> None:
        """Take note that nobody drives any more: whoever comes next has to press Start."""
        self.inputs, self._grips = None, ()
        if self.phase in (Phase.DRIVING, Phase.LOST):
            self.phase = Phase.PAUSED

    def grip(self, hand: int) -> None:
        """Close a gripper that is open, open one that is closed."""
        self.closed[hand] = float(self.closed[hand] <= 0.5)

    def ask(self, ask: Ask) -> None:
        """Do what the operator asks for; what makes no sense now is left undone."""
        setting, channels, value = self.setting, self.meaning.channels, ask.value
        match ask.what:
            case what if what in _EVENTS:
                self._judge(_EVENTS[what])
            case "stop":
                released = Phase.PAUSED if self._begun else Phase.READY
                self.phase, self._armed = (Phase.STOPPED if value else released), False
            case "start" if self.phase in (Phase.READY, Phase.PAUSED):
                self.phase, self._armed = Phase.DRIVING, False
            case "pause" if self.phase in (Phase.DRIVING, Phase.LOST):
                self.phase = Phase.PAUSED
            case "practice" if not self._begun:
                self.practises = value
            case "mode" if value in self.modes and value != setting.mode.name:
                self.setting = setting.switched(mode=self.modes[value])
            case "mask":
                bits = "".join("01"[index in value] for index in range(channels.size))
                mode = mode_of_mask(bits, channels)
                self.setting = setting if mode.name == setting.mode.name else setting.switched(mode=mode)
            case "focus" if value in ("hand", "base") and value != setting.focus:
                self.setting = setting.switched(focus=value)
            case "hand" if value in self.meaning.hands and value != setting.hand:
                self.setting = setting.switched(hand=value)
            case "frame" if value in self.frames:
                self.setting = replace(setting, frame=value)
            case "speed":
                self.setting = replace(setting, speed=max(value, 0.05))
            case "lock":
                locked = sorted(set(value) & set(range(len(channels.joints))))
                self.setting = setting.switched(locked=tuple(locked))

    def act(self, view: View) -> Intent | EpisodeEvent:
        """Return the intent now, or what becomes of the episode."""
        self._begun |= self.phase is Phase.DRIVING
        if (slept := _slept()) > self._slept + DEAD_MAN_TIME:  # who wakes a computer may not see the robot
            self._slept = slept
            self.lose()
        if self._undone:
            self._find(view)
        if self._event is not None:
            event, self._event = self._event, None
            self._undone = event is EpisodeEvent.UNDO
            return event
        driven = self.inputs is not None and self.inputs.on and self.age <= DEAD_MAN_TIME
        if self.phase is Phase.DRIVING and not driven:
            self.phase, self._armed = self._lost, False
        elif self.phase is Phase.LOST and driven and self._armed:
            self.phase = Phase.DRIVING
        if self.phase is not Phase.DRIVING or self.inputs is None:
            return EpisodeEvent.PAUSE
        inputs = self.inputs if self._armed else self.inputs.let_go()
        if self.setting.is_single:
            self._pick_axis(inputs)
        intent = self.meaning.intent(inputs, self.setting, view.state, self.age, self.round_trip)
        return replace(intent, grippers=tuple(self.closed))

    @property
    def between(self) -> EpisodeEvent | None:
        """The request that holds before an episode begins: QUIT, PAUSE in the e-stop, or None."""
        if self._quits or self._event is EpisodeEvent.QUIT:
            return EpisodeEvent.QUIT
        return EpisodeEvent.PAUSE if self.phase is Phase.STOPPED else None

    @property
    def age(self) -> float:
        """Of the newest input [s]."""
        return self._clock() - self.received if self.inputs else np.inf

    def _find(self, view: View) -> None:
        """Take the grippers as they are."""
        self.closed, self._grips = list(view.grippers or [0.0] * len(self.meaning.hands)), ()
        self._undone = False

    def _pick_axis(self, inputs: Input) -> None:
        """Take the axis that is moved most, once the one before was let go; another one is a switch."""
        owned = np.abs(inputs.axes) * self.meaning.mask(self.setting)
        if (self.setting.axis >= 0 and owned[self.setting.axis]) or not owned.any():
            return
        axis, first = int(np.argmax(owned)), self.setting.axis < 0
        if axis != self.setting.axis:
            changed = replace if first else Setting.switched
            self.setting = changed(self.setting, axis=axis)

    def _judge(self, event: EpisodeEvent) -> None:
        """End the episode, once it has begun; one that runs is paused before it is quit."""
        if event is EpisodeEvent.QUIT and self._event is not None and self._event.judges:
            self._quits = True
        elif event is EpisodeEvent.QUIT and self._begun and self.phase in (Phase.DRIVING, Phase.LOST):
            self.phase = Phase.PAUSED
        elif self._event is not EpisodeEvent.QUIT and (self._begun or event.drops):
            self._event = event
            self.phase = Phase.STOPPED if self.phase is Phase.STOPPED else Phase.PAUSED


def _slept() -> float:
    """Return how long this computer has slept [s]; too little where it is busy between the two readings."""
    return time_with_sleep() - time.monotonic()

"""Runs episodes by the wall clock: an operator steers, observers watch.

```
view ─▶ operator ─ intent ─▶ loop.step ─▶ frame ─▶ observers (at the recording rate)
          └ event: end, throw away, begin again, pause, go back
```
"""

import gc
import logging
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from copy import copy
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from handrail.collect.operators.operator import EpisodeEvent, Operator
from handrail.collect.session.loop import ROUNDING, Disturbance, EpisodeLoop
from handrail.collect.session.outcome import Outcome
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.errors import HandrailError, shown
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import Controller
from handrail.controllers.interface.intent import LONG_AGO, Intent
from handrail.controllers.numerics.threads import single_threaded
from handrail.datasets.recording.frames import Frame

_log = logging.getLogger(__name__)
_OBSERVED = ("state", "environment", "images", "intent", "wall_clock")  # of a frame, at its first period


@dataclass
class Sampling:
    """Makes the frames of a recording from those of the robot's periods."""

    period: float
    """Of the recording [s]."""
    number: int = 0
    """Of the frames so far."""
    _open: Frame | None = None

    def add(self, frame: Frame, time: float) -> Frame | None:
        """Take a period that ends at a time [s]; return the frame that is complete with it, if one is.

        A frame of several periods is what was observed and asked at the first one and sent at the last one.
        """
        if first := self._open:
            observed = {name: getattr(first, name) for name in _OBSERVED}
            frame = replace(frame, **observed, contacts=max(first.contacts, frame.contacts))
        if not (frame.done or time >= (self.number + 1) * self.period - ROUNDING):
            self._open = frame
            return None
        self._open, self.number = None, self.number + 1
        return frame if frame.number == self.number - 1 else replace(frame, number=self.number - 1)


class Undo:
    """Wraps the loop of an episode that has begun: what came after the last mark can be forgotten.

    Args:
        loop: of the episode.
        sampling: of its recording.
    """

    def __init__(self, loop: EpisodeLoop, sampling: Sampling) -> None:
        self._loop = loop
        self.mark(sampling)

    @property
    def safe(self) -> int:
        """The number of recorded frames that no undo takes back."""
        return self._sampling.number

    def mark(self, sampling: Sampling) -> None:
        """Take note of this moment, to come back to; the robot rested, and goes on."""
        self._world, self._frames = self._loop.checkpoint(), self._loop.tally.frames
        self._sampling = copy(sampling)

    def back(self, sampling: Sampling) -> Sampling:
        """Go back to the last mark; return the recording's sampling of then."""
        if self._loop.tally.frames == self._frames:
            return sampling
        self._loop.restore(self._world)
        return copy(self._sampling)


class Observer(Protocol):
    """Something that watches a session: a recorder, a display."""

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note that an episode begins."""

    def see(self, frame: Frame) -> None:
        """Take one moment; after an undo its number has been there before, and what that was is forgotten."""


@dataclass(frozen=True)
class Session:
    """Runs episodes."""

    env: HandrailEnv
    controller: Controller
    operator: Operator
    observers: Sequence[Observer] = ()
    """Shown every frame."""
    realtime: bool = False
    """Pace the loop by the wall clock."""
    disturbances: Sequence[Disturbance] = ()
    control_period: float | None = None
    """Of the controller [s]; the robot's by default."""
    record_period: float | None = None
    """Of the frames [s]; the robot's by default."""
    undoes: bool = False
    """Whether the operator may go back."""

    def run(self, seed: int) -> Outcome:
        """Run one episode and return how it went; the same seed gives the same episode.

        However it ends, the robot is stopped. An episode that the operator throws away or begins again is
        over at once; one that they end lasts one period more, in which the robot begins to brake.
        """
        loop = EpisodeLoop(self.env, self.controller, self.control_period, self.disturbances)
        with single_threaded():
            if self.realtime:  # later collections of garbage look at what is new only: none may halt the loop
                gc.unfreeze()
                gc.collect()
                gc.freeze()
            self.operator.reset(loop.begin(seed), np.random.default_rng([seed, 1]))
            for observer in self.observers:
                observer.begin(self.env, seed)
            loop.tally.start()
            try:
                with _first_in_turn() if self.realtime or self.env.real else nullcontext():
                    ended_by = self._until_over(loop)
            finally:
                self.env.plant.stop()
                self._warn_if_slow(loop)
        return loop.tally.outcome(loop.now.info, ended_by, not self.env.real)

    def _until_over(self, loop: EpisodeLoop) -> EpisodeEvent | None:
        """Run an episode that has begun; return what the operator said to end it."""
        sampling = Sampling(self.record_period or self.env.period)
        undo = Undo(loop, sampling) if self.undoes else None
        asked, event, rested = Intent.idle(Channels.of(self.env.model.description)), None, False
        while not loop.now.done:
            view = loop.look()
            with loop.tally.timed("operator"):
                answer = self.operator.act(view)
            if not isinstance(answer, Intent | EpisodeEvent):
                name, wanted = type(self.operator).__name__, "an Intent or an EpisodeEvent"
                raise HandrailError(f"operator {name}: expected {wanted}, got {shown(answer)}")
            event = answer if isinstance(answer, EpisodeEvent) else None
            # while they do not steer, what the controller hears is stale, and it brakes
            asked = answer if isinstance(answer, Intent) else _stale(asked)
            if event is not None and event.drops:
                break
            if event is EpisodeEvent.UNDO and undo:
                sampling = undo.back(sampling)
            elif event is EpisodeEvent.PAUSE and loop.rests:
                loop.rest()
                rested = True
            else:
                if undo and rested:  # an undo in a pause goes back to where the robot set out
                    undo.mark(sampling)
                rested = False
                if frame := sampling.add(loop.step(asked, event), loop.time):
                    frame = replace(frame, safe=undo.safe) if undo else frame
                    with loop.tally.timed("observers"):
                        for observer in self.observers:
                            observer.see(frame)
            if self.realtime:
                loop.tally.pace()
        return event if event and (event.judges or event.drops) else None  # else the task has ended it

    def _warn_if_slow(self, loop: EpisodeLoop) -> None:
        """Warn when more than one update in a hundred took longer than the period, in real time."""
        period, times = loop.control_period, loop.tally.solve_times
        slow = [seconds for seconds in times if seconds > period]
        if 100 * len(slow) > len(times) and (self.realtime or self.env.real):
            _log.warning(
                "controller: %d of %d updates took longer than the period of %.0f ms, the longest %.0f ms",
                *(len(slow), len(times), 1e3 * period, 1e3 * max(slow)),
            )


@contextmanager
def _first_in_turn() -> Iterator[None]:
    """Let other programs wait for this thread, where the system allows that, and for none that it begins.

    Niceness counts only among the programs of one terminal, on many a Linux.
    """
    if sys.platform != "linux" or os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK != os.SCHED_OTHER:
        yield  # it has the turn that its user gave it
        return
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(1))
    try:
        yield
    finally:
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER | os.SCHED_RESET_ON_FORK, os.sched_param(0))


def _stale(intent: Intent) -> Intent:
    return replace(intent, mask=np.zeros_like(intent.mask), time=LONG_AGO)

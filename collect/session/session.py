"""Runs episodes by the wall clock: an operator steers, observers watch.

```
view ─▶ operator ─ intent ─▶ loop.step ─▶ frame ─▶ observers (at the recording rate)
          └ event: end, throw away, begin again, pause, go back
```
"""

import gc
import logging
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from typing import Protocol

import numpy as np

from handrail.collect.operators.operator import EpisodeEvent, Operator
from handrail.collect.session.loop import ROUNDING, Disturbance, EpisodeLoop
from handrail.collect.session.outcome import Outcome, Tally
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import Controller
from handrail.controllers.interface.intent import LONG_AGO, Intent
from handrail.controllers.numerics.threads import single_threaded
from handrail.datasets.recording.frames import Frame

_log = logging.getLogger(__name__)


class Sampling:
    """Makes the frames of a recording from those of the robot's periods.

    Args:
        period: of the recording [s].

    Attributes:
        number: of the frames so far.
    """

    def __init__(self, period: float) -> None:
        self._period, self._next = period, period
        self._open: Frame | None = None
        self.number = 0

    def add(self, frame: Frame, time: float) -> Frame | None:
        """Take a period that ends at a time [s]; return the frame that is complete with it, if one is."""
        lasting = _lasting(self._open, frame) if self._open else frame
        if not (frame.done or time >= self._next - ROUNDING):
            self._open = lasting
            return None
        self._next += self._period
        self._open, self.number = None, self.number + 1
        return replace(lasting, number=self.number - 1)


def _lasting(first: Frame, last: Frame) -> Frame:
    """Return the frame of some periods: observed and asked at the first one, sent at the last one."""
    return replace(
        last,
        state=first.state,
        environment=first.environment,
        images=first.images,
        intent=first.intent,
        wall_clock=first.wall_clock,
        contacts=max(first.contacts, last.contacts),
    )


class Undo:
    """Wraps the loop of an episode that has begun: what came after the last mark can be forgotten.

    Args:
        loop: of the episode.
        sampling: of its recording.
    """

    def __init__(self, loop: EpisodeLoop, sampling: Sampling) -> None:
        self._loop = loop
        self._take(sampling)

    @property
    def safe(self) -> int:
        """The number of recorded frames that no undo takes back."""
        return self._sampling.number

    def mark(self, sampling: Sampling) -> None:
        """Take note of this moment, to come back to; the robot rests."""
        if self._moved:
            self._take(sampling)

    def back(self, sampling: Sampling) -> Sampling:
        """Go back to the last mark; return the recording's sampling of then."""
        if not self._moved:
            return sampling
        self._loop.restore(self._world)
        return copy(self._sampling)

    @property
    def _moved(self) -> bool:
        return self._loop.tally.frames > self._frames

    def _take(self, sampling: Sampling) -> None:
        self._world, self._frames = self._loop.checkpoint(), self._loop.tally.frames
        self._sampling = copy(sampling)


class Observer(Protocol):
    """Something that watches a session: a recorder, a display."""

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note that an episode begins."""

    def see(self, frame: Frame) -> None:
        """Take one moment; after an undo its number has been there before, and what that was is forgotten."""


class Session:
    """Runs episodes.

    Args:
        env: a robot, its world and a task.
        controller: completes the intent.
        operator: whoever steers.
        observers: shown every frame.
        realtime: pace the loop by the wall clock.
        disturbances: what acts on the robot from outside.
        control_period: of the controller [s]; the robot's by default.
        record_period: of the frames [s]; the robot's by default.
        undoes: whether the operator may go back.
    """

    def __init__(
        self,
        env: HandrailEnv,
        controller: Controller,
        operator: Operator,
        observers: Sequence[Observer] = (),
        realtime: bool = False,
        disturbances: Sequence[Disturbance] = (),
        control_period: float | None = None,
        record_period: float | None = None,
        undoes: bool = False,
    ) -> None:
        self.env = env
        self._loop = EpisodeLoop(env, controller, control_period, disturbances)
        self._operator, self._observers = operator, observers
        self._realtime, self._undoes = realtime, undoes
        self._record_period = record_period or env.period

    def warm_up(self, seed: int, operator: Operator) -> None:
        """Run an episode that nobody sees, so that what is compiled or built at its first use is there.

        Args:
            seed: of the episode.
            operator: steers in every way that there will be.
        """
        self._run(seed, operator, (), False)

    def run(self, seed: int, tell_paused: Callable[[bool], None] = lambda paused: None) -> Outcome:
        """Run one episode and return how it went; the same seed gives the same episode.

        However it ends, the robot is stopped. An episode that the operator throws away or begins again is
        over at once; one that they end lasts one period more, in which the robot begins to brake.

        Args:
            seed: of the episode.
            tell_paused: is told when the operator pauses, and when they go on.
        """
        return self._run(seed, self._operator, self._observers, self._realtime, tell_paused)

    def _run(
        self,
        seed: int,
        operator: Operator,
        observers: Sequence[Observer],
        realtime: bool,
        tell_paused: Callable[[bool], None] = lambda paused: None,
    ) -> Outcome:
        loop, paused = self._loop, False
        with single_threaded():
            if realtime:  # later collections of garbage look at what is new only: none may halt the loop
                gc.unfreeze()
                gc.collect()
                gc.freeze()
            operator.reset(loop.begin(seed), np.random.default_rng([seed, 1]))
            for observer in observers:
                observer.begin(self.env, seed)
            loop.tally.start()
            sampling = Sampling(self._record_period)
            undo = Undo(loop, sampling) if self._undoes else None
            asked, event = Intent.idle(Channels.of(self.env.model.description)), None
            try:
                while not loop.now.done:
                    asked, event = _listen(loop, operator, asked)
                    if paused is not (event is EpisodeEvent.PAUSE):
                        paused = not paused
                        tell_paused(paused)
                    if event is not None and event.drops:
                        break
                    if event is EpisodeEvent.UNDO and undo:
                        sampling = undo.back(sampling)
                    elif event is EpisodeEvent.PAUSE and loop.rests:
                        if undo:
                            undo.mark(sampling)
                        loop.tally.held()
                    elif frame := sampling.add(loop.step(asked, event), loop.time):
                        frame = replace(frame, safe=undo.safe) if undo else frame
                        with loop.tally.timed("observers"):
                            for observer in observers:
                                observer.see(frame)
                    if realtime:
                        loop.tally.pace()
            finally:
                self.env.robot.stop()
                self._warn_if_slow(loop.tally, realtime)
        ended_by = None if event is EpisodeEvent.PAUSE else event
        return loop.tally.outcome(loop.now.info, ended_by, not self.env.real)

    def _warn_if_slow(self, tally: Tally, realtime: bool) -> None:
        """Warn when more than one update in a hundred took longer than the period, in real time."""
        period = self._loop.control_period
        slow = [seconds for seconds in tally.solve_times if seconds > period]
        if 100 * len(slow) > len(tally.solve_times) and (realtime or self.env.real):
            _log.warning(
                "controller: %d of %d updates took longer than the period of %.0f ms, the longest %.0f ms",
                *(len(slow), len(tally.solve_times), 1e3 * period, 1e3 * max(slow)),
            )


def _listen(loop: EpisodeLoop, operator: Operator, before: Intent) -> tuple[Intent, EpisodeEvent | None]:
    """Ask the operator; while they do not steer, what the controller hears is stale, and it brakes."""
    view = loop.look()
    with loop.tally.timed("operator"):
        asked = operator.act(view)
    if isinstance(asked, EpisodeEvent):
        return replace(before, mask=np.zeros_like(before.mask), time=LONG_AGO), asked
    return asked, None

"""The one loop that runs task, operator, controller and recorder: observe, ask, complete, act, record.

```
view ─▶ operator ─ intent ─▶ controller ─ command ─▶ env.step ─▶ robot.send   at the robot's rate,
          │                  (at its own rate)          │                     along the command's trajectory
          └ event: end, throw away, begin again, pause  └─▶ frame ─▶ observers (at the recording rate)
```
"""

import gc
import logging
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from handrail.collect.envs.env import HandrailEnv
from handrail.collect.operators.operator import EpisodeEvent, Operator, View
from handrail.collect.session.driver import Driver, Rate
from handrail.collect.session.outcome import Outcome, Tally
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import Controller
from handrail.controllers.interface.intent import Intent
from handrail.controllers.numerics.threads import single_threaded
from handrail.datasets.recording.frames import Frame

_log = logging.getLogger(__name__)
_CREEP = 1e-3  # slower, a paused robot is sent rest [m/s, rad/s]
_LONG_AGO = -1e6  # when nobody who steers has asked last [s]


class Observer(Protocol):
    """Something that watches a session: a recorder, a display."""

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note that an episode begins."""
        ...

    def see(self, frame: Frame) -> None:
        """Take one moment; after an undo its number has been there before, and what that was is forgotten."""
        ...


class Disturbance(Protocol):
    """Something from outside that acts on the robot: pushes."""

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note that an episode begins."""
        ...

    def act(self) -> None:
        """Act during the period that begins now."""
        ...


class _Mark(NamedTuple):
    """A moment to come back to."""

    world: object
    tally: Tally
    recording: Rate
    frame: Frame | None
    number: int


class Session:
    """Runs episodes.

    The robot is sent a command every step of the environment; a controller that is asked less often says what
    to send in between.

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
        self._controller = controller
        self._operator = operator
        self._observers = observers
        self._realtime = realtime
        self._disturbances = disturbances
        self._control_period = control_period or env.period
        self._record_period = record_period or env.period
        self._undoes = undoes

    def warm_up(self, seed: int, operator: Operator) -> None:
        """Run an episode that nobody sees, so that what is compiled or built at its first use is there.

        Args:
            seed: of the episode.
            operator: steers in every way that there will be.
        """
        unseen = copy(self)
        unseen._operator, unseen._observers, unseen._realtime = operator, (), False
        unseen.run(seed)

    def run(self, seed: int, tell_paused: Callable[[bool], None] = lambda paused: None) -> Outcome:
        """Run one episode and return how it went; the same seed gives the same episode.

        However it ends, the robot is stopped. An episode that the operator throws away or begins again is
        over at once; one that they end lasts one period more, in which the robot begins to brake.

        Args:
            seed: of the episode.
            tell_paused: is told when the operator pauses, and when they go on.
        """
        with single_threaded():
            self._begin(seed)
            try:
                while not self._done:
                    self._listen(tell_paused)
                    if self._event is not None and self._event.drops:
                        break
                    if self._event is EpisodeEvent.UNDO and self._undoes:
                        self._undo()
                    elif self._event is EpisodeEvent.PAUSE and self._rests:
                        self._mark()
                        self._tally.held()
                    else:
                        self._show(self._step())
                    if self._realtime:
                        self._tally.pace()
            finally:
                self.env.robot.stop()
                self._warn_if_slow()
            paused = self._event is EpisodeEvent.PAUSE
            return self._tally.outcome(self._info, None if paused else self._event, not self.env.real)

    def _warn_if_slow(self) -> None:
        """Warn when more than one update in a hundred took longer than the period, in real time."""
        slow = [seconds for seconds in self._tally.solve_times if seconds > self._control_period]
        often = 100 * len(slow) > len(self._tally.solve_times)
        if often and (self._realtime or self.env.real):
            _log.warning(
                "controller: %d of %d updates took longer than the period of %.0f ms, the longest %.0f ms",
                *(len(slow), len(self._tally.solve_times)),
                *(1e3 * self._control_period, 1e3 * max(slow)),
            )

    def _begin(self, seed: int) -> None:
        if self._realtime:
            _tidy()
        self._observation, self._info = self.env.reset(seed=seed)
        self._driver = Driver(self._controller, self.env, self._control_period)
        self._operator.reset(self._view(), np.random.default_rng([seed, 1]))
        for other in (*self._observers, *self._disturbances):
            other.begin(self.env, seed)
        self._tally, self._recording = Tally(seed, self.env.period), Rate(self._record_period)
        self._recording.take()
        self._intent = Intent.idle(Channels.of(self.env.model.description))
        self._event: EpisodeEvent | None = None
        self._frame: Frame | None = None
        self._done, self._number = False, 0
        self._marked: _Mark | None = None
        self._mark()

    def _mark(self) -> None:
        """Take note of this moment, to come back to; the robot rests."""
        if self._undoes and (self._marked is None or self._marked.tally.frames < self._tally.frames):
            now = self.env.checkpoint(), self._tally.mark(), copy(self._recording), self._frame, self._number
            self._marked = _Mark(*now)

    def _undo(self) -> None:
        """Go back to the moment that was noted last."""
        marked = self._marked
        if marked is None or marked.tally.frames == self._tally.frames:
            return
        self._observation, self._info = self.env.restore(marked.world)
        self._tally.undo(marked.tally)
        self._recording, self._frame, self._number = copy(marked.recording), marked.frame, marked.number
        self._driver = Driver(self._controller, self.env, self._control_period, self._tally.frames)

    def _listen(self, tell_paused: Callable[[bool], None]) -> None:
        """Ask the operator; while they do not steer, what the controller hears is stale, and it brakes."""
        self._wall_clock, before = self._tally.elapsed, self._event
        with self._tally.timed("operator"):
            view = self._view()
            asked = self._operator.act(view)
        self._state = view.state
        if isinstance(asked, EpisodeEvent):
            self._event = asked
            self._intent = replace(self._intent, mask=np.zeros_like(self._intent.mask), time=_LONG_AGO)
        else:
            self._event, self._intent = None, asked
        if EpisodeEvent.PAUSE in (before, self._event) and before is not self._event:
            tell_paused(self._event is EpisodeEvent.PAUSE)

    def _step(self) -> Frame:
        """Move the robot for one of its periods; return what happened."""
        env, tally, observation = self.env, self._tally, self._observation
        with tally.timed("controller"):
            if self._driver.drive(tally.frames, self._state, self._intent):
                tally.updated(self._driver.command)
            action = self._driver.action(tally.frames)
            if self._event is EpisodeEvent.PAUSE and np.abs(action[:-1]).max() < _CREEP:
                action[:-1] = 0.0  # a controller may come ever nearer to rest
        commanded = tally.elapsed
        with tally.timed("environment"):
            for disturbance in self._disturbances:
                disturbance.act()
            self._observation, _, terminated, truncated, self._info = env.step(action)
        tally.moved(self._info["contacts"])
        judged = self._event is not None and self._event.judges
        self._done = terminated or truncated or judged
        return Frame(
            state=observation["agent_pos"],
            environment=observation["environment_state"],
            images=observation.get("pixels", {}),
            intent=self._intent,
            action=self._info["sent"],
            command=action.astype(np.float32),
            diagnostics=self._driver.command.diagnostics,
            contacts=self._info["contacts"],
            success=self._event is EpisodeEvent.SUCCESS
            if judged and env.real
            else bool(self._info["is_success"]),
            done=self._done,
            wall_clock=self._wall_clock,
            number=self._number,
            safe=self._marked.number if self._marked else self._number + 1,
            undos=self._tally.undos,
            plan=self._driver.command.plan or self._driver.command,
            commanded=commanded,
        )

    def _show(self, frame: Frame) -> None:
        """Show the observers a frame when its time is over."""
        self._frame = frame if self._frame is None else _lasting(self._frame, frame)
        if not (self._done or self._recording.due(self._tally.frames * self.env.period)):
            return
        with self._tally.timed("observers"):
            for observer in self._observers:
                observer.see(self._frame)
        self._recording.take()
        self._frame, self._number = None, self._number + 1

    @property
    def _rests(self) -> bool:
        commanded = self._state.commanded
        return commanded is not None and not commanded.any()

    def _view(self) -> View:
        return View(self.env.robot.state(), self.env.task_state(), self._observation)


def _tidy() -> None:
    """Collect garbage now, and let later collections look at what is new only: none may halt the loop."""
    gc.unfreeze()
    gc.collect()
    gc.freeze()


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

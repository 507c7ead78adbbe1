"""Policies that plan ahead: one beside the loop, in a thread of its own; several that are asked at once."""

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import replace
from typing import Protocol

import numpy as np

from handrail.collect.operators.operator import View
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.intent import LONG_AGO, Intent

_ROUNDING = 1e-6  # of a time [s]


class Planner(Protocol):
    """A policy as an operator that plans ahead and can be interrupted."""

    @property
    def doubt(self) -> float:
        """How unsure it is of its last answer; 0 of one that does not say."""
        ...

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""

    def replan(self) -> None:
        """Forget the plan: the robot is elsewhere than it led."""

    def act(self, view: View) -> Intent:
        """Return the intent now."""
        ...

    def chunk(self) -> list[Intent]:
        """Return what is planned for the periods after that, each with its time."""
        ...


class ThreadedPlanner:
    """Plans in a thread of its own, so that no inference delays the loop; what is sent goes by time.

    A plan begins at the moment that it was made for; what of it lies in the past is left out. Its last intent
    counts as new for a period, since a plan of one intent comes a period late; it then goes on until it is
    stale (0.25 s after its own time), and the robot brakes. So it does while a policy has no plan yet. An
    intent's `raw.age` is that of the plan's beginning.

    Args:
        planner: used by the thread alone.
        period: of the planner [s].
    """

    def __init__(self, planner: Planner, period: float) -> None:
        self._planner, self._period = planner, period
        self._thread = ThreadPoolExecutor(1, "policy")
        self._made: Future[tuple[list[Intent], float]] | None = None  # the plan that is being made
        self._forgets = False  # whether that one is made for a robot that was elsewhere
        self._plan: list[Intent] = []
        self._first = 0  # of the plan, which of its intents is for now
        self.doubt = 0.0

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""
        if self._made:
            wait([self._made])
        self._made, self._forgets, self._plan, self.doubt = None, False, [], 0.0
        self._planner.reset(view, rng)

    def replan(self) -> None:
        """Forget the plan, and the one that is being made."""
        self._plan, self._forgets = [], True

    def act(self, view: View) -> Intent:
        """Return what is planned for now; let the thread plan on from what is seen."""
        now, fresh = view.state.time, self._forgets
        if self._made and self._made.done():
            plan, doubt = self._made.result()
            self._made = None
            if not fresh:
                self._plan, self.doubt = plan, doubt
        if self._made is None:
            self._made, self._forgets = self._thread.submit(self._think, view, fresh), False
        if not self._plan:
            return Intent(np.zeros(0), np.zeros(0, dtype=bool), time=LONG_AGO)  # of no robot: unusable
        self._first = sum(each.time <= now + _ROUNDING for each in self._plan) - 1
        intent = self._plan[max(self._first, 0)]
        lasts = now < intent.time + self._period + _ROUNDING
        raw = replace(intent.raw, age=max(now - self._plan[0].time, 0.0))
        return replace(intent, time=now if lasts else intent.time, raw=raw)

    def chunk(self) -> list[Intent]:
        """Return what is planned for the periods to come."""
        return self._plan[self._first + 1 :]

    def _think(self, view: View, fresh: bool) -> tuple[list[Intent], float]:
        """Return what is planned from a moment on, and how unsure that is; in the thread."""
        if fresh:
            self._planner.replan()
        return [self._planner.act(view), *self._planner.chunk()], self._planner.doubt


class Ensemble:
    """Several policies, of which the first drives; how far they differ says how unsure it is.

    `doubt = max_c std_members(û_c) / full_c` over the channels that it commands. A policy that draws its
    actions (Diffusion), said several times, is an ensemble of its own samples.

    Args:
        members: two or more.
        full: what full speed is on each channel, (m,).
    """

    def __init__(self, members: Sequence[Planner], full: FloatArray) -> None:
        self._members, self._full = members, full
        self.doubt = 0.0

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""
        self.doubt = 0.0
        for member in self._members:
            member.reset(view, rng)

    def replan(self) -> None:
        """Forget the plans."""
        for member in self._members:
            member.replan()

    def act(self, view: View) -> Intent:
        """Return the first one's intent."""
        intents = [member.act(view) for member in self._members]
        spread = np.std([each.values for each in intents], axis=0) / self._full
        self.doubt = float(np.max(spread[intents[0].mask], initial=0.0))
        return intents[0]

    def chunk(self) -> list[Intent]:
        """Return what the first one plans."""
        return self._members[0].chunk()

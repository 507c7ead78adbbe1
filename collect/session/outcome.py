"""How an episode went, and the counting along it."""

import contextlib
import time
from collections.abc import Iterator, Mapping
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from handrail.collect.operators.operator import EpisodeEvent
from handrail.controllers.interface.command import Command, Status

_NOT_DONE = "judge: not done"  # why an episode failed that the operator calls a success


@dataclass(frozen=True)
class Outcome:
    """How an episode went.

    Attributes:
        seed: of the environment.
        success: whether the task was done, as its judge says; on a real robot, as the operator says.
        failure_reason: why not; empty after a success.
        frames: periods of the robot.
        seconds: simulated time [s].
        wall_time: time it took [s].
        brakes: updates in which the controller braked the robot.
        late: periods that a real-time loop overran.
        contact_onsets: forbidden contacts that began.
        contact_periods: periods with a forbidden contact.
        smallest_distance: smallest signed distance, tool against work surfaces left out [m].
        spent: where the wall time went, by part of the loop [s].
        started: Unix time at its beginning [s].
        ended_by: what the operator said to end it; None where the task was the judge.
        paused: time for which the operator had the robot stand still, the braking not counted [s].
        undos: how often the operator went back to an earlier moment.
        practice: whether it was only tried, and is not to be saved.
    """

    seed: int
    success: bool
    failure_reason: str
    frames: int
    seconds: float
    wall_time: float
    brakes: int
    late: int
    contact_onsets: int
    contact_periods: int
    smallest_distance: float
    spent: Mapping[str, float]
    started: float
    ended_by: EpisodeEvent | None = None
    paused: float = 0.0
    undos: int = 0
    practice: bool = False

    @property
    def operator_says(self) -> str:
        """What the operator said of it: success, failure, or nothing."""
        return str(self.ended_by) if self.ended_by and self.ended_by.judges else ""

    @property
    def kept(self) -> bool:
        """Whether it is to be saved: neither practice, nor thrown away, nor begun again."""
        return not self.practice and (self.ended_by is None or self.ended_by.judges)


class Tally:
    """Counts along an episode and keeps its pace.

    Args:
        seed: of the episode.
        period: of the robot [s].
    """

    def __init__(self, seed: int, period: float) -> None:
        self._seed, self._period = seed, period
        self.frames = self.undos = self.brakes = 0
        self._late = self._held = self._contacts = self._contacts_begun = self._contact_periods = 0
        self._smallest = np.inf
        self._spent: dict[str, float] = {}
        self.solve_times: list[float] = []
        self.start()

    def start(self) -> None:
        """Let the clock begin now."""
        self._started, self._start, self._deadline = time.time(), time.perf_counter(), 0.0

    @property
    def elapsed(self) -> float:
        """Wall time since the episode began [s]."""
        return time.perf_counter() - self._start

    @contextlib.contextmanager
    def timed(self, part: str) -> Iterator[None]:
        """Add the time of a block to a part of the loop."""
        start = time.perf_counter()
        yield
        self._spent[part] = self._spent.get(part, 0.0) + time.perf_counter() - start

    def updated(self, command: Command) -> None:
        """Count an update of the controller."""
        self.solve_times.append(command.diagnostics.solve_time)
        self.brakes += Status(command.diagnostics.status).brakes
        self._smallest = min(self._smallest, command.diagnostics.smallest_distance)

    def moved(self, contacts: int) -> None:
        """Count a period of the robot."""
        self.frames += 1
        self._contacts_begun += max(contacts - self._contacts, 0)
        self._contact_periods += contacts > 0
        self._contacts = contacts

    def held(self) -> None:
        """Count a period in which a paused robot stood still."""
        self._held += 1

    def back_to(self, before: "Tally") -> "Tally":
        """Return the counts of an earlier moment; how often that happened, and the clock, go on."""
        tally = copy(before)
        tally.undos, tally._late, tally._held = self.undos + 1, self._late, self._held
        tally._deadline = self._deadline
        return tally

    def pace(self) -> None:
        """Wait for the end of the period, or note that it is over.

        After a halt of more than a period the beat begins anew: what was missed is not caught up in a rush.
        """
        self._deadline += self._period
        ahead = self._deadline - self.elapsed
        if ahead > 0:
            time.sleep(ahead)
            return
        self._late += 1
        if -ahead > self._period:
            self._deadline = self.elapsed

    def outcome(self, info: Mapping[str, Any], ended_by: EpisodeEvent | None, judged: bool = True) -> Outcome:
        """Return how it went.

        Args:
            info: of the last step.
            ended_by: what the operator said to end it.
            judged: whether the task's judge knows the truth; else the operator's word counts.
        """
        success, reason = bool(info["is_success"]), str(info["failure_reason"])
        if ended_by is not None:
            says = ended_by is EpisodeEvent.SUCCESS
            success = success if judged else says
            reason = "" if success else (reason or _NOT_DONE) if says else f"operator: {ended_by}"
        return Outcome(
            seed=self._seed,
            success=success,
            failure_reason=reason,
            frames=self.frames,
            seconds=self.frames * self._period,
            wall_time=self.elapsed,
            brakes=self.brakes,
            late=self._late,
            contact_onsets=self._contacts_begun,
            contact_periods=self._contact_periods,
            smallest_distance=float(self._smallest),
            spent=dict(self._spent),
            started=self._started,
            ended_by=ended_by,
            paused=self._held * self._period,
            undos=self.undos,
        )

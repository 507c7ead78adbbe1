"""How an episode went, and the counting along it."""

import contextlib
import time
from collections.abc import Iterator, Mapping
from copy import copy
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from handrail.collect.operators.operator import EpisodeEvent
from handrail.controllers.interface.command import Command, Status

_NOT_DONE = "judge: not done"  # why an episode failed that the operator calls a success
_COUNTED = (
    *("seed", "frames", "brakes", "late", "contact_onsets", "contact_periods", "smallest_distance"),
    *("started", "undos"),
)


@dataclass(frozen=True)
class Outcome:
    """How an episode went."""

    seed: int
    """Of the environment."""
    success: bool
    """Whether the task was done, as its judge says; on a real robot, as the operator says."""
    failure_reason: str
    """Empty after a success."""
    frames: int
    """Periods of the robot."""
    seconds: float
    """Simulated time [s]."""
    wall_time: float
    brakes: int
    """Updates in which the controller braked the robot."""
    late: int
    """Periods that a real-time loop overran."""
    contact_onsets: int
    """Forbidden contacts that began."""
    contact_periods: int
    smallest_distance: float
    """Signed, tool against work surfaces left out [m]."""
    spent: Mapping[str, float]
    """Wall time by part of the loop [s]."""
    started: float
    """Unix time at its beginning [s]."""
    ended_by: EpisodeEvent | None = None
    """The operator's word that ended it; None where the task was the judge."""
    undos: int = 0
    """How often the operator went back to an earlier moment."""
    practice: bool = False
    """Whether it was only tried, and is not to be saved."""

    @property
    def operator_says(self) -> str:
        """The operator's judgement: success, failure, or none."""
        return str(self.ended_by) if self.ended_by and self.ended_by.judges else ""

    @property
    def kept(self) -> bool:
        """Whether it is to be saved: neither practice, nor thrown away, nor begun again."""
        return not self.practice and (self.ended_by is None or self.ended_by.judges)


@dataclass
class Tally:
    """Counts along an episode, and its clock; what they mean is said of `Outcome`."""

    seed: int
    period: float
    """Of the robot [s]."""
    frames: int = 0
    undos: int = 0
    brakes: int = 0
    late: int = 0
    contact_onsets: int = 0
    contact_periods: int = 0
    smallest_distance: float = np.inf
    solve_times: list[float] = field(default_factory=list)
    _contacts: int = 0  # now
    _spent: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Let the clock begin."""
        self.start()

    def start(self) -> None:
        """Let the clock begin now."""
        self.started, self._start, self._deadline = time.time(), time.perf_counter(), 0.0

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
        self.smallest_distance = min(self.smallest_distance, float(command.diagnostics.smallest_distance))

    def moved(self, contacts: int) -> None:
        """Count a period of the robot."""
        self.frames += 1
        self.contact_onsets += max(contacts - self._contacts, 0)
        self.contact_periods += contacts > 0
        self._contacts = contacts

    def back_to(self, before: "Tally") -> "Tally":
        """Return the counts of an earlier moment; how often that happened, and the clock, go on."""
        tally = copy(before)
        tally.undos, tally.late, tally._deadline = self.undos + 1, self.late, self._deadline
        return tally

    def pace(self) -> None:
        """Wait for the end of the period, or note that it is over.

        After a halt of more than a period the beat begins anew: what was missed is not caught up in a rush.
        """
        self._deadline += self.period
        ahead = self._deadline - self.elapsed
        if ahead > 0:
            time.sleep(ahead)
            return
        self.late += 1
        if -ahead > self.period:
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
            success=success,
            failure_reason=reason,
            seconds=self.frames * self.period,
            wall_time=self.elapsed,
            spent=dict(self._spent),
            ended_by=ended_by,
            **{name: getattr(self, name) for name in _COUNTED},
        )

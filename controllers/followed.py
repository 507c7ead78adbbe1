"""What the robot follows: the command that was sent last, and since when."""

import math
from dataclasses import dataclass

from handrail.controllers.arrays import FloatArray
from handrail.controllers.command import Command
from handrail.controllers.controller import State


@dataclass(frozen=True)
class Followed:
    """A command that was sent.

    Attributes:
        command: it.
        time: when [s].
        period: time from the command before it [s].
    """

    command: Command
    time: float
    period: float

    def elapsed(self, time: float) -> float:
        """Return how long ago it was sent, at a time, which may be no number [s]: then, one period."""
        return max(time - self.time, 0.0) if math.isfinite(time) else self.period

    def velocity(self, time: float) -> FloatArray:
        """Return what is commanded at a time, which may be no number, (n,)."""
        return self.command.velocity(self.elapsed(time))

    def next_start(self, state: State) -> FloatArray:
        """Return what the next command goes on from, (n,): this one while it lasts, then as measured."""
        elapsed = self.elapsed(state.time)
        return state.v if self.command.trajectory.is_over(elapsed) else self.command.velocity(elapsed)

    def accelerations(self, time: float, count: int) -> FloatArray:
        """Return what is commanded over `count` intervals from a time on, (count, n); zero after the end."""
        return self.command.trajectory.accelerations(count, self.elapsed(time))

    def then(self, command: Command, time: float) -> "Followed":
        """Return what is followed after the next command, sent at a time, which may be no number."""
        elapsed = self.elapsed(time)
        return Followed(command, time if math.isfinite(time) else self.time + elapsed, elapsed)

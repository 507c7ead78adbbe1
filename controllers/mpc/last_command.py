"""The command that was sent last, and since when: the motion that the robot follows."""

import math
from dataclasses import dataclass

from handrail.controllers.interface.command import Command


@dataclass(frozen=True)
class LastCommand:
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
        """Return how long ago it was sent [s]; one period where the time is no number, or not later."""
        return time - self.time if math.isfinite(time) and time > self.time else self.period

    @classmethod
    def after(
        cls, before: "LastCommand | None", command: Command, time: float, period: float
    ) -> "LastCommand":
        """Return a command as the last one.

        Args:
            before: the last one until now, if any.
            command: that is sent now.
            time: now, which may be no number [s].
            period: from one command to the next, if it is not known yet [s].
        """
        if before is None:
            return cls(command, time if math.isfinite(time) else 0.0, period)
        elapsed = before.elapsed(time)
        late = before.command.trajectory.is_over(elapsed)
        now = time if math.isfinite(time) else before.time + elapsed
        return cls(command, now, before.period if late else elapsed)

"""What the robot follows: the command that was sent last, and since when."""

import math
from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import State
from handrail.controllers.robot.description import Limits


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
        """Return how long ago it was sent [s]; one period where the time is no number, or not later."""
        return time - self.time if math.isfinite(time) and time > self.time else self.period

    def velocity(self, time: float) -> FloatArray:
        """Return what is commanded at a time, which may be no number, (n,)."""
        return self.command.velocity(self.elapsed(time))

    def accelerations(self, time: float, count: int) -> FloatArray:
        """Return what is commanded over `count` intervals from a time on, (count, n); zero after the end."""
        return self.command.trajectory.accelerations(count, self.elapsed(time))


def following(last: Followed | None, command: Command, time: float, period: float) -> Followed:
    """Return what is followed after a command.

    Args:
        last: what was followed before.
        command: that is sent now.
        time: now, which may be no number [s].
        period: from one command to the next, if it is not known yet [s].
    """
    if last is None:
        return Followed(command, time if math.isfinite(time) else 0.0, period)
    elapsed = last.elapsed(time)
    late = last.command.trajectory.is_over(elapsed)
    return Followed(
        command, time if math.isfinite(time) else last.time + elapsed, last.period if late else elapsed
    )


def sent_velocity(state: State, followed: Followed | None, limits: Limits) -> FloatArray:
    """Return the velocity that the robot is being sent, (n,) [m/s, rad/s]; every command begins with it.

    What the robot says that it was sent; else what was commanded; before the first command as it moves. A
    command between two such velocities keeps the limit of acceleration whatever the robot does.

    Args:
        state: of the robot; parts of it may be no numbers.
        followed: the command that was sent last, if any.
        limits: of the robot.
    """
    size, said = len(limits.velocity), state.commanded
    if said is not None and said.shape == (size,) and np.isfinite(said).all():
        velocity = said
    elif followed is not None:
        velocity = followed.velocity(state.time)
    else:
        velocity = state.v if state.is_of(size) else np.zeros(size)
    return np.minimum(np.maximum(velocity, -limits.velocity), limits.velocity)

"""The one protocol behind which every controller stands."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from handrail.controllers.arrays import FloatArray, are_finite, frozen, real
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.parts import Limits
from handrail.controllers.robot.shape import Obstacle


@dataclass(frozen=True)
class State:
    """The known state of the robot at a time."""

    q: FloatArray  # measured positions, (n,) [m, rad]
    v: FloatArray  # measured velocities, dq/dt, (n,) [m/s, rad/s]
    time: float = 0.0  # on the robot's clock [s]; later at every update
    commanded: FloatArray = None  # type: ignore[assignment]
    """The velocity that the robot was sent last, (n,). It alone knows, for what is asked may be limited on
    the way: controllers do not remember it. Left out of a robot that moves as it is told, which is `v`."""
    expected: FloatArray = None  # type: ignore[assignment]
    """Where it will be when it has done what it was sent so far, (n,): a robot that takes positions, or is
    far away, lags behind. Left out of one that does not, which is `q`."""

    def __post_init__(self) -> None:
        """Copy the arrays and make them read-only."""
        for name in ("q", "v"):
            object.__setattr__(self, name, frozen(getattr(self, name), what=f"{name} of a state"))
        for name, usual in (("commanded", self.v), ("expected", self.q)):
            values = getattr(self, name)
            array = usual if values is None else frozen(values, what=f"{name} of a state")
            object.__setattr__(self, name, array)
        object.__setattr__(self, "time", real(self.time, "time of a state"))

    def is_of(self, size: int) -> bool:
        """Whether all of it but the time are finite numbers for a robot with `size` coordinates."""
        told = self.commanded is self.v or _known(self.commanded, size)
        near = self.expected is self.q or _known(self.expected, size)
        return told and near and _known(self.q, size) and _known(self.v, size)

    def sent(self, limits: Limits, followed: FloatArray | None = None) -> FloatArray:
        """Return the velocity with which every command begins, (n,): the one sent last, within the limits.

        A command between two such velocities keeps the limit of acceleration whatever the robot does. Where
        the robot does not say what it was sent, it is what it follows; where nobody knows that, how it moves;
        where it does not say that, rest.

        Args:
            limits: of the robot.
            followed: the velocity of the last command now, (n,).
        """
        size = len(limits.velocity)
        for said in (self.commanded, self.v if followed is None else followed):
            if _known(said, size):
                return np.minimum(np.maximum(said, -limits.velocity), limits.velocity)
        return np.zeros(size)


def _known(values: FloatArray, size: int) -> bool:
    """Whether values are as many finite numbers."""
    return values.shape == (size,) and are_finite(values)


class Controller(Protocol):
    """Completes a partial command: state, intent → command. Never raises because of an intent."""

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the past (warm start, last command) and take the scene of a new episode."""
        ...

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take what stands around now, where, how fast it moves, and what the hand holds.

        Things may appear and vanish; what was commanded is not forgotten. Where the scene makes no sense (two
        things of one name, a frame that the robot lacks) updates brake until one is seen that does.
        """
        ...

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from `state.time` on."""
        ...

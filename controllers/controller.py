"""The one protocol behind which every controller stands."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.command import Command
from handrail.controllers.intent import Intent
from handrail.controllers.jit import exact_jit
from handrail.controllers.shape import Obstacle


@dataclass(frozen=True)
class State:
    """What is measured of the robot: q (n,) and v = dq/dt (n,), at a time [s]."""

    q: FloatArray
    v: FloatArray
    time: float = 0.0

    def __post_init__(self) -> None:
        """Copy the arrays and make them read-only."""
        object.__setattr__(self, "q", frozen(self.q))
        object.__setattr__(self, "v", frozen(self.v))

    @property
    def is_finite(self) -> bool:
        """Whether every entry is a number."""
        return math.isfinite(self.time) and _finite(self.q) and _finite(self.v)


@exact_jit
def _finite(values):
    """Whether all values are numbers, whatever their shape."""
    finite = True
    for value in values.flat:
        finite &= np.isfinite(value)
    return finite


class Controller(Protocol):
    """Completes a partial command: state, intent → command. Never raises because of an intent."""

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the past (warm start, last command) and take the scene of a new episode."""
        ...

    def observe(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now, how fast they move, and what the hand holds.

        Called before an update if any moves, while something is held, and when it was let go.

        Raises:
            HandrailError: what stands around is not what did at the beginning of this episode.
        """
        ...

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from `state.time` on."""
        ...

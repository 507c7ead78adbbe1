"""The one protocol behind which every controller stands."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.command import Command
from handrail.controllers.intent import Intent
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
        return bool(np.all(np.isfinite(self.q)) and np.all(np.isfinite(self.v)) and np.isfinite(self.time))


class Controller(Protocol):
    """Completes a partial command: state, intent → command. Never raises because of an intent."""

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the past (warm start, last command) and take the scene of a new episode."""
        ...

    def observe(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now and how fast they move; called before an update if any moves.

        Raises:
            HandrailError: they are not the obstacles of this episode.
        """
        ...

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from `state.time` on."""
        ...

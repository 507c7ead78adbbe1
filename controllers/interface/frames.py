"""In which frames an operator means the twists, and for which point of the tool."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen

_FARTHEST = 5.0  # farthest tool point from the tool frame [m]


@dataclass(frozen=True)
class Frames:
    """How twists are meant."""

    base: str = "base"  # frame of the base twist: `base` or `world`
    tool: str = "world"  # frame of the end-effector twist: `world` or `tool`
    point: FloatArray = field(default_factory=lambda: np.zeros(3))
    """The tool point, in the tool frame [m], (3,)."""

    def __post_init__(self) -> None:
        """Copy the array and make it read-only."""
        object.__setattr__(self, "point", frozen(self.point, what="tool point of an intent"))

    @cached_property
    def are_known(self) -> bool:
        """Whether the frames exist, and the point is one."""
        named = self.base in ("base", "world") and self.tool in ("world", "tool")
        return named and self.point.shape == (3,) and bool(np.all(np.abs(self.point) <= _FARTHEST))

    @cached_property
    def parameters(self) -> FloatArray:
        """The parameters of the tracking objective, (5,): base in world, tool in tool, point."""
        return frozen([self.base == "world", self.tool == "tool", *self.point])

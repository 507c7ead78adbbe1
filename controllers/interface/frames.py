"""In which frames an operator means the twists, and for which point of the tool."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError, unknown_name

_FARTHEST = 5.0  # farthest tool point from the tool frame [m]


@dataclass(frozen=True)
class Frames:
    """How twists are meant.

    Attributes:
        base: frame of the base twist: `base` or `world`.
        tool: frame of the end-effector twist: `world` or `tool`.
        point: the tool point, in the tool frame [m], (3,).
    """

    base: str = "base"
    tool: str = "world"
    point: FloatArray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        """Copy the array and make it read-only."""
        object.__setattr__(self, "point", frozen(self.point, what="tool point of an intent"))

    def check(self) -> None:
        """Check the names and the point.

        Raises:
            HandrailError: a frame that does not exist, or a point that is none.
        """
        if self.base not in ("base", "world"):
            raise unknown_name("frame of the base twist", self.base, ("base", "world"))
        if self.tool not in ("world", "tool"):
            raise unknown_name("frame of the end-effector twist", self.tool, ("world", "tool"))
        if self.point.shape != (3,) or not np.all(np.abs(self.point) <= _FARTHEST):
            raise HandrailError(
                f"tool point: expected 3 numbers within {_FARTHEST} m, got {self.point.tolist()}"
            )

    @cached_property
    def are_known(self) -> bool:
        """Whether `check` finds nothing wrong."""
        try:
            self.check()
        except HandrailError:
            return False
        return True

    @cached_property
    def parameters(self) -> FloatArray:
        """The parameters of the tracking objective, (5,): base in world, tool in tool, point."""
        return frozen([self.base == "world", self.tool == "tool", *self.point])


USUAL = Frames()
"""Those of an operator who says nothing about it."""

"""A thing that slides along a rail: a drawer."""

from dataclasses import dataclass

from handrail.controllers.arrays import FloatArray, frozen


@dataclass(frozen=True)
class Slide:
    """A rail with stops at both ends.

    Attributes:
        axis: direction in which it opens, in the object's frame, a unit vector, (3,).
        travel: from closed to open [m].
        damping: force per speed [N s/m].
        friction: force that it takes to move it [N].
    """

    axis: FloatArray
    travel: float
    damping: float = 8.0
    friction: float = 3.0

    def __post_init__(self) -> None:
        """Copy the array and make it read-only."""
        object.__setattr__(self, "axis", frozen(self.axis))

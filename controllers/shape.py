"""Convex shapes and scene obstacles, the vocabulary of collision avoidance."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError

ShapeKind = Literal["box", "capsule", "sphere", "cylinder"]

_SIZES = {"box": 3, "capsule": 2, "sphere": 1, "cylinder": 2}


@dataclass(frozen=True)
class Shape:
    """A convex shape in its own frame, centred, long axis z.

    Attributes:
        kind: what it is.
        size: box: full lengths (x, y, z) [m]; capsule and cylinder: radius and length of the
            straight part [m]; sphere: radius [m].
    """

    kind: ShapeKind
    size: FloatArray

    def __post_init__(self) -> None:
        """Check the size.

        Raises:
            HandrailError: unknown kind, wrong number of sizes, or a size that is not positive.
        """
        if self.kind not in _SIZES:
            raise HandrailError(f"shape {self.kind!r}: expected one of {', '.join(_SIZES)}")
        object.__setattr__(self, "size", frozen(self.size))
        if self.size.shape != (_SIZES[self.kind],) or not np.all(self.size > 0):
            raise HandrailError(
                f"size of a {self.kind}: expected {_SIZES[self.kind]} positive lengths [m], "
                f"got {self.size.tolist()}"
            )


@dataclass(frozen=True)
class Obstacle:
    """A shape in the scene, or one that the robot holds.

    Attributes:
        name: unique in the scene.
        shape: its geometry.
        position: of its centre in the world, or in `frame` [m], (3,).
        rotation: world, or `frame`, from shape, (3, 3).
        velocity: of its centre in the world [m/s], (3,); predicted constant; none of what is held.
        work_surface: whether tool shapes may come close to it (a table that is worked on).
        frame: the robot's frame that it is fixed to because the hand holds it; empty for the world.
    """

    name: str
    shape: Shape
    position: FloatArray
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    velocity: FloatArray = field(default_factory=lambda: np.zeros(3))
    work_surface: bool = False
    frame: str = ""

    def __post_init__(self) -> None:
        """Copy the arrays and make them read-only."""
        for name in ("position", "rotation", "velocity"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def held(self) -> bool:
        """Whether it moves with the robot."""
        return bool(self.frame)

"""Convex shapes and scene obstacles, the vocabulary of collision avoidance."""

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.jit import exact_jit

ShapeKind = Literal["box", "capsule", "sphere", "cylinder"]

_SIZES = {"box": 3, "capsule": 2, "sphere": 1, "cylinder": 2}
_ROTATION_ERROR = 1e-5  # of a matrix that still is a rotation; float32 has about 1e-7


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
            HandrailError: unknown kind, wrong number of sizes, or a size that is not positive and finite.
        """
        if self.kind not in _SIZES:
            raise HandrailError(f"shape {self.kind!r}: expected one of {', '.join(_SIZES)}")
        object.__setattr__(self, "size", frozen(self.size, what=f"size of a {self.kind}"))
        if self.size.shape != (_SIZES[self.kind],) or not all(0.0 < length < np.inf for length in self.size):
            raise HandrailError(
                f"size of a {self.kind}: expected {_SIZES[self.kind]} positive lengths [m], "
                f"got {self.size.tolist()}"
            )


class Kept(NamedTuple):
    """What of an obstacle stays the same while it moves; two of them can be compared."""

    name: str
    frame: str
    kind: ShapeKind
    size: bytes
    work_surface: bool


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
        """Copy the arrays and make them read-only.

        Raises:
            HandrailError: position or velocity are not three finite numbers, or the rotation is none.
        """
        for name in ("position", "velocity"):
            values = frozen(getattr(self, name), what=f"{name} of obstacle {self.name!r}")
            if values.shape != (3,) or not _all_finite(values):
                raise HandrailError(
                    f"{name} of obstacle {self.name!r}: expected three finite numbers, got {values.tolist()}"
                )
            object.__setattr__(self, name, values)
        rotation = frozen(self.rotation, what=f"rotation of obstacle {self.name!r}")
        if rotation.shape != (3, 3) or not _is_rotation(rotation):
            raise HandrailError(
                f"rotation of obstacle {self.name!r}: expected a rotation matrix, got {rotation.tolist()}"
            )
        object.__setattr__(self, "rotation", rotation)

    @property
    def held(self) -> bool:
        """Whether it moves with the robot."""
        return bool(self.frame)

    @property
    def kept(self) -> Kept:
        """What stays the same while it moves."""
        return Kept(self.name, self.frame, self.shape.kind, self.shape.size.tobytes(), self.work_surface)


@exact_jit
def _all_finite(values):
    """Whether all values are numbers, (3,)."""
    return np.isfinite(values[0]) and np.isfinite(values[1]) and np.isfinite(values[2])


@exact_jit
def _is_rotation(R):
    """Whether `RᵀR = I` and `det R = 1`, (3, 3)."""
    right = True
    for i in range(3):
        for j in range(3):
            product = R[0, i] * R[0, j] + R[1, i] * R[1, j] + R[2, i] * R[2, j]
            right &= abs(product - (i == j)) < _ROTATION_ERROR
    volume = R[0, 0] * (R[1, 1] * R[2, 2] - R[1, 2] * R[2, 1])
    volume -= R[0, 1] * (R[1, 0] * R[2, 2] - R[1, 2] * R[2, 0])
    volume += R[0, 2] * (R[1, 0] * R[2, 1] - R[1, 1] * R[2, 0])
    return right and volume > 0.0

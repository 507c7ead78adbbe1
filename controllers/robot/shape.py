"""Convex shapes and scene obstacles, the vocabulary of collision avoidance."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError, shown

ShapeKind = Literal["box", "capsule", "sphere", "cylinder"]

_SIZES = {"box": 3, "capsule": 2, "sphere": 1, "cylinder": 2}
_LARGEST = 1e6  # of a length [m]: distances are still numbers
_ROTATION_ERROR = 1e-5  # of a matrix that still is a rotation; float32 has about 1e-7


@dataclass(frozen=True)
class Shape:
    """A convex shape in its own frame, centred, long axis z."""

    kind: ShapeKind  # what it is
    size: FloatArray
    """Box: full lengths (x, y, z) [m]; capsule and cylinder: radius and length of the straight part [m];
    sphere: radius [m]."""

    def __post_init__(self) -> None:
        """Check the size."""
        if self.kind not in _SIZES:
            raise HandrailError(f"shape {self.kind!r}: expected one of {', '.join(_SIZES)}")
        object.__setattr__(self, "size", frozen(self.size, what=f"size of a {self.kind}"))
        count, usable = _SIZES[self.kind], np.all((self.size > 0.0) & (self.size < _LARGEST))
        if self.size.shape != (count,) or not usable:
            raise HandrailError(
                f"size of a {self.kind}: expected {count} positive lengths [m], got {self.size.tolist()}"
            )


@dataclass(frozen=True)
class Obstacle:
    """A shape in the scene, or one that the robot holds."""

    name: str  # unique in the scene
    shape: Shape  # its geometry
    position: FloatArray  # of its centre in the world, or in `frame` [m], (3,)
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))  # world, or `frame`, from shape, (3, 3)
    velocity: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Of its centre in the world [m/s], (3,); predicted constant; none of what is held."""
    work_surface: bool = False  # whether tool shapes may come close to it (a table that is worked on)
    frame: str = ""  # the robot's frame that it is fixed to because the hand holds it; empty for the world

    def __post_init__(self) -> None:
        """Copy the arrays and make them read-only."""
        if not isinstance(self.shape, Shape):
            raise HandrailError(f"shape of obstacle {self.name!r}: expected a Shape, got {shown(self.shape)}")
        for name in ("position", "velocity"):
            values = frozen(getattr(self, name), what=f"{name} of obstacle {self.name!r}")
            if values.shape != (3,) or not np.all(np.abs(values) < _LARGEST):
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
    def kept(self) -> tuple[object, ...]:
        """The properties that stay the same while it moves."""
        return self.name, self.frame, self.shape.kind, self.shape.size.tobytes(), self.work_surface


def _is_rotation(R: FloatArray) -> bool:
    """Whether `RᵀR = I` and `det R = 1`, (3, 3)."""
    if not np.all(np.abs(R) < 2.0):  # nor may its squares overflow
        return False
    return bool(np.all(np.abs(R.T @ R - np.eye(3)) < _ROTATION_ERROR) and np.linalg.det(R) > 0.0)

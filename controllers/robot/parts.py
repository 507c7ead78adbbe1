"""The parts of a robot as its description file names them, each with the range of its values."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.shape import Shape
from handrail.controllers.typed import Listed, Number, Positive, Text

_PLANAR = ("x", "y", "theta")
_BEYOND = 0.01  # touching, where fingers are sent to close [m]
ZERO = (0.0, 0.0, 0.0)
_ASIDE = 1e-6

AtLeastZero = Annotated[float, Meta(ge=0, le=1e6)]
Vector = tuple[Number, Number, Number]
Lengths = tuple[Positive, Positive, Positive]
Numbers = Annotated[FloatArray, Listed(tuple[Number, ...])]
Positives = Annotated[FloatArray, Listed(tuple[Positive, ...])]


@dataclass(frozen=True)
class Placement:
    """A rigid transform: `p_parent = rotation @ p + translation` [m]."""

    translation: FloatArray  # (3,)
    rotation: FloatArray  # (3, 3)

    @classmethod
    def of(cls, translation: Vector, rpy: Vector) -> "Placement":
        """Return the transform with roll, pitch and yaw [rad]."""
        return cls(frozen(translation), frozen(matrix_from_rpy(np.array(rpy))))


@dataclass(frozen=True)
class PlacedShape:
    """A shape on a frame of the robot; `tool` shapes may work close to work surfaces."""

    name: str
    frame: str
    shape: Shape
    placement: Placement
    tool: bool = False
    rgba: tuple[float, ...] = (0.5, 0.5, 0.5, 1.0)


@dataclass(frozen=True)
class Limits:
    """Box limits of the generalised coordinates, each (n,), in [m] or [rad] and seconds."""

    position_lower: Numbers
    position_upper: Numbers
    velocity: Positives
    acceleration: Positives
    effort: Positives
    servo: Positives

    def check_inside(self, what: str, joints: tuple[str, ...], values: Iterable[float]) -> None:
        """Check that the first joints [m, rad] are inside their limits, or raise HandrailError."""
        ranges = zip(joints, self.position_lower, values, self.position_upper, strict=False)
        for name, lower, value, upper in ranges:
            if not lower <= value <= upper:
                raise HandrailError(f"{what} of joint {name}: expected {lower} to {upper}, got {value}")


@dataclass(frozen=True)
class Jaw:
    """A finger that turns, instead of two that slide."""

    frame: Text
    """The URDF's link that turns, at the joint's zero, about its z axis; more angle is more open."""
    closed: Number
    open: Number
    parallel: Number
    """The angle at which its pad is parallel to the other finger's [rad], and `gap` from it [m]."""
    gap: Positive

    def __post_init__(self) -> None:
        """Check the order of its angles."""
        if not self.closed <= self.parallel < self.open:
            raise HandrailError(
                f"expected closed <= parallel < open, got closed {self.closed}, parallel {self.parallel}, "
                f"open {self.open}"
            )


@dataclass(frozen=True)
class Camera:
    """A camera on a frame, and the point there that it looks at [m]; `up` is above in its pictures."""

    name: Text
    frame: Text
    position: Vector
    looks_at: Vector
    up: Vector = (0.0, 0.0, 1.0)
    fovy: Annotated[float, Meta(ge=5, le=150)] = 75.0
    """Vertical field of view [deg]."""

    def __post_init__(self) -> None:
        """Check that its axes can be told."""
        if not float(np.linalg.norm(np.cross(self.axes[:, 1], self._forward))) > _ASIDE:
            raise HandrailError(
                f"camera {self.name}: expected looks_at away from position, and up aside from there; "
                f"got {self.position}, {self.looks_at}, up {self.up}"
            )

    @property
    def _forward(self) -> FloatArray:
        return np.subtract(self.looks_at, self.position)

    @property
    def axes(self) -> FloatArray:
        """Right, up and back in the frame, as columns, (3, 3); zero where they cannot be told."""
        forward, right = self._forward, np.cross(self._forward, self.up)
        axes = np.column_stack([right, np.cross(right, forward), -forward])
        return axes / np.maximum(np.linalg.norm(axes, axis=0), _ASIDE)


@dataclass(frozen=True)
class Gripper:
    """Two fingers that slide along the x axis of a placement on a frame; lengths [m], force [N], speed [m/s].

    With a `jaw` the finger to +x stands still, its inner face at x = 0, and the one to −x turns.
    `shape` is the collision shape that encloses the fingers, open or closed: real ones stand in for it.
    """

    frame: Text
    mass: Positive
    finger_mass: Positive
    finger_size: Lengths
    stroke: Positive
    tip: Positive
    force: Positive
    speed: Positive
    friction: Positive
    translation: Vector = ZERO
    rpy: Vector = ZERO
    shape: Text = "fingers"
    jaw: Jaw | None = None

    @cached_property
    def placement(self) -> Placement:
        """The fingers' axes on the frame."""
        return Placement.of(self.translation, self.rpy)

    @property
    def travel(self) -> float:
        """From closed to open, as its joints count it: [m] of both fingers that slide, [rad] of a jaw."""
        return self.stroke if self.jaw is None else self.jaw.open - self.jaw.closed

    @property
    def pace(self) -> float:
        """Its speed, as its joints count it [m/s, rad/s]."""
        return self.speed if self.jaw is None else self.speed * self.travel / self.stroke

    @property
    def beyond(self) -> float:
        """How far beyond touching it is sent to close, as its joints count it [m, rad]."""
        return _BEYOND if self.jaw is None else _BEYOND * self.travel / self.stroke


@dataclass(frozen=True)
class Arm:
    """The part of a robot that a URDF describes: an arm, or several with torso and head."""

    urdf: Path
    mesh_root: Path  # where its `package://` paths start from
    prefix: str  # that names of its joints and frames begin with, where there are several
    joints: tuple[str, ...]  # those that move, prefix included
    on: str  # frame of the robot that it stands on
    mount: Placement  # there


@dataclass(frozen=True)
class EndEffector:
    """A hand: its tool point is placed on a frame."""

    name: str  # among several, such as "left"; "" of the only one
    frame: str
    placement: Placement
    gripper: Gripper | None

    def named(self, part: str) -> str:
        """Return the name of a part of it: `tool` of the only hand, `left.tool` of one of several."""
        return f"{self.name}.{part}" if self.name else part


@dataclass(frozen=True)
class Base:
    """The arm's base: planar or fixed, its mass [kg], height, length and width [m]."""

    kind: Literal["planar", "fixed"]
    mass: Positive
    height: AtLeastZero
    size: tuple[Positive, Positive]

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of its coordinates; none where it is fixed."""
        return _PLANAR if self.kind == "planar" else ()


@dataclass(frozen=True)
class WorldScale:
    """How large the world is that a robot works in: tasks, sticks and margins are made to its measure.

    `tables`, `goals` (of the hand), `pitch` and `roll` are the lowest and the highest [m, rad].
    """

    scale: Positive = 1.0
    """Of lengths and speeds against those of a robot as large as a person."""
    pace: Positive = 1.0
    """Share of full stick's speeds and rates; less than 1 where the base is slow for its size."""
    tables: tuple[Positive, Positive] = (0.55, 0.65)
    goals: tuple[Positive, Positive] = (0.7, 1.0)
    cube: Positive = 0.05
    """Edge of the cube that it carries [m]."""
    pitch: tuple[Number, Number] = (0.0, 1.5)
    """Of goals of a hand on an arm of fewer than six joints: 0 points ahead, π/2 down [rad]."""
    roll: tuple[Number, Number] = (-1.5, 1.5)
    """Of such goals, about where the hand points [rad]."""

    def __post_init__(self) -> None:
        """Check that ranges rise."""
        for name in ("tables", "goals", "pitch", "roll"):
            lowest, highest = getattr(self, name)
            if lowest > highest:
                raise HandrailError(f"{name}: expected the lowest and the highest, got {lowest}, {highest}")

    @property
    def grip(self) -> float:
        """Scale of what the hand does close to a thing: of the cube against one of 5 cm."""
        return self.cube / 0.05

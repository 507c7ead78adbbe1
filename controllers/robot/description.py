"""A robot is data: the description file that MuJoCo, pinocchio and CasADi are all built from."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError, check_known, restated
from handrail.controllers.numerics.rotation import matrix_to_axis
from handrail.controllers.robot import parts
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.shape import Shape, ShapeKind
from handrail.controllers.robot.urdf import chain, find_urdf
from handrail.controllers.strict_toml import read_toml
from handrail.controllers.typed import Fraction, Positive, Text, decoded

SCENE_CAMERA = "scene"
_WORD = re.compile("[a-z][a-z0-9_]*")
_TAKEN = ("apart", "arm", "base", "ee", "joint", "pair", "tool", "torso")
_KINDS: tuple[ShapeKind, ...] = ("box", "capsule", "cylinder", "sphere")


@dataclass(frozen=True)
class RobotDescription:
    """Everything that Handrail knows of a robot; see `robots/ridgeback_ur10.toml` for the format."""

    name: str
    base: parts.Base
    arms: tuple[parts.Arm, ...]
    hands: tuple[parts.EndEffector, ...]
    home: FloatArray
    limits: parts.Limits
    collision: tuple[parts.PlacedShape, ...]
    self_pairs: tuple[tuple[str, str], ...]
    self_margins: FloatArray  # largest margin that each self pair can keep [m]
    visual: tuple[parts.PlacedShape, ...]
    cameras: tuple[parts.Camera, ...]
    world: parts.WorldScale

    def __post_init__(self) -> None:
        """Check that its parts fit together."""
        _check_joints(self)
        _check_names(self)

    @property
    def arm_joints(self) -> tuple[str, ...]:
        """Names of the generalised coordinates that are not the base's."""
        return tuple(joint for arm in self.arms for joint in arm.joints)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of all generalised coordinates, base first."""
        return self.base.joints + self.arm_joints

    @cached_property
    def moves(self) -> tuple[tuple[bool, ...], ...]:
        """Which joints move each hand; () where all move a single one."""
        chains = [set(chain(self.arms, hand.frame)) | set(self.base.joints) for hand in self.hands]
        moves = tuple(tuple(joint in moving for joint in self.joints) for moving in chains)
        return () if len(moves) == 1 and all(moves[0]) else moves

    def check_hands(self, what: str, needed: int) -> None:
        """Check that the robot has as many hands as something needs, such as `mode both`."""
        if len(self.hands) < needed:
            raise HandrailError(
                f"{what}: expected a robot with {needed} hands, got {self.name} with {len(self.hands)}"
            )

    @property
    def camera_names(self) -> tuple[str, ...]:
        """Names of the cameras that can be recorded: its own, and one that overlooks the scene."""
        return (*(camera.name for camera in self.cameras), SCENE_CAMERA)


def robot_names() -> list[str]:
    """Return the robots that come with Handrail, and those of installed packages."""
    return sorted(ROBOTS)


def load_description(robot: str | Path) -> RobotDescription:
    """Read a robot by name, by `module:name`, or from a description file."""
    path = Path(os.path.expanduser(robot)) if str(robot).endswith(".toml") else ROBOTS.find(str(robot)).file
    if not path.is_file():
        raise HandrailError(
            f"unknown robot {str(robot)!r}: expected --robot FILE.toml or one of {', '.join(robot_names())}"
        )
    return described(read_toml(path, "robot description"), path)


def described(tables: Mapping[str, Any], path: Path) -> RobotDescription:
    """Return the robot that the tables of a description file say, which lies at a path."""
    where = f"robot description {path}"
    file = decoded(tables, _File, where)
    with restated(where, HandrailError):
        return _described(file, path.parent)


@dataclass(frozen=True)
class _Arm:
    urdf: Text
    joints: Annotated[tuple[Text, ...], Meta(min_length=1)]
    prefix: str = ""
    on: Text = "planar_base"
    translation: parts.Vector = parts.ZERO
    rpy: parts.Vector = parts.ZERO


@dataclass(frozen=True)
class _Hand:
    frame: Text
    name: str = ""
    translation: parts.Vector = parts.ZERO
    rpy: parts.Vector = parts.ZERO
    gripper: parts.Gripper | None = None


@dataclass(frozen=True)
class _Home:
    q: parts.Numbers


@dataclass(frozen=True)
class _Shape:
    """A shape in a file: one of four kinds; a capsule from `a` to `b`, the others `at` a place."""

    frame: Text
    name: Text = ""
    box: parts.Lengths | None = None
    capsule: Positive | None = None
    cylinder: tuple[Positive, Positive] | None = None
    sphere: Positive | None = None
    at: parts.Vector | None = None
    rpy: parts.Vector | None = None
    a: parts.Vector | None = None
    b: parts.Vector | None = None
    tool: bool = False
    rgba: Annotated[tuple[Fraction, ...], Meta(min_length=3, max_length=4)] = (0.5, 0.5, 0.5, 1.0)

    def __post_init__(self) -> None:
        """Check that it is one shape, placed as such."""
        kinds = [kind for kind in _KINDS if getattr(self, kind) is not None]
        if len(kinds) != 1:
            got = " and ".join(kinds) or "none"
            raise HandrailError(f"shape {self.name}: expected one of {', '.join(_KINDS)}, got {got}")
        ends, place = (self.a, self.b), (self.at, self.rpy)
        if self.capsule is None and ends != (None, None):
            raise HandrailError(f"shape {self.name}: expected a {kinds[0]} with at and rpy, got a or b")
        if self.capsule is not None and (None in ends or place != (None, None) or self.a == self.b):
            raise HandrailError(
                f"shape {self.name}: expected a capsule from a to b, apart, without at and rpy; "
                f"got {self.a} and {self.b}; a sphere has no length"
            )

    def placed(self) -> parts.PlacedShape:
        """Return the shape on its frame."""
        if self.capsule is not None:
            a, b = np.array(self.a), np.array(self.b)
            length = float(np.linalg.norm(b - a))
            placement = parts.Placement(frozen((a + b) / 2), frozen(matrix_to_axis((b - a) / length)))
            shape = Shape("capsule", np.array([self.capsule, length]))
        else:
            kind: ShapeKind = next(kind for kind in _KINDS if getattr(self, kind) is not None)
            shape = Shape(kind, np.atleast_1d(getattr(self, kind)))
            placement = parts.Placement.of(self.at or parts.ZERO, self.rpy or parts.ZERO)
        return parts.PlacedShape(self.name, self.frame, shape, placement, self.tool, (*self.rgba, 1.0)[:4])


class _Pair(Struct, array_like=True, frozen=True, forbid_unknown_fields=True):
    """Two shapes that can meet, and the largest margin that they can keep [m]."""

    first: Text
    second: Text
    margin: parts.AtLeastZero = np.inf


@dataclass(frozen=True)
class _SelfCollision:
    pairs: tuple[_Pair, ...]


_Shapes = Annotated[tuple[_Shape, ...], Meta(min_length=1)]


@dataclass(frozen=True)
class _File:
    """The tables of a description file."""

    name: Text
    base: parts.Base
    arm: Annotated[tuple[_Arm, ...], Meta(min_length=1)]
    hand: Annotated[tuple[_Hand, ...], Meta(min_length=1)]
    home: _Home
    limits: parts.Limits
    self_collision: _SelfCollision
    collision: _Shapes
    visual: _Shapes = ()
    camera: tuple[parts.Camera, ...] = ()
    world: parts.WorldScale = field(default_factory=parts.WorldScale)


def _described(file: _File, folder: Path) -> RobotDescription:
    pairs = file.self_collision.pairs
    return RobotDescription(
        name=file.name,
        base=file.base,
        arms=tuple(_arm(arm, folder) for arm in file.arm),
        hands=tuple(
            parts.EndEffector(
                hand.name, hand.frame, parts.Placement.of(hand.translation, hand.rpy), hand.gripper
            )
            for hand in file.hand
        ),
        home=file.home.q,
        limits=file.limits,
        collision=tuple(shape.placed() for shape in file.collision),
        self_pairs=tuple((pair.first, pair.second) for pair in pairs),
        self_margins=frozen([pair.margin for pair in pairs]),
        visual=tuple(shape.placed() for shape in file.visual),
        cameras=file.camera,
        world=file.world,
    )


def _arm(arm: _Arm, folder: Path) -> parts.Arm:
    joints = tuple(arm.prefix + name for name in arm.joints)
    place = parts.Placement.of(arm.translation, arm.rpy)
    return parts.Arm(*find_urdf(arm.urdf, folder), arm.prefix, joints, arm.on, place)


def _check_joints(robot: RobotDescription) -> None:
    """Check one number a joint, and home inside the limits."""
    check_once(robot.arm_joints, "arm: joints")
    limits, size = robot.limits, len(robot.joints)
    vectors = {f"limits: {name}": values for name, values in vars(limits).items()}
    for name, values in ({"home: q": robot.home} | vectors).items():
        if values.shape != (size,):
            raise HandrailError(f"{name}: expected {size} numbers, one a joint, got {len(values)}")
    for name, lower, upper in zip(robot.joints, limits.position_lower, limits.position_upper, strict=True):
        if not lower < upper:
            raise HandrailError(
                f"limits of joint {name}: expected position_lower below position_upper, "
                f"got {lower} and {upper}"
            )
    limits.check_inside("home", robot.joints, robot.home)


def _check_names(robot: RobotDescription) -> None:
    """Check that shapes and cameras have names of their own, and that no others are used."""
    check_once(robot.camera_names, "camera")
    names = [shape.name for shape in robot.collision]
    check_once([*names, "floor"], "collision")  # where something else is the floor
    if "" in names:
        raise HandrailError(f"collision[{names.index('')}]: expected an entry 'name', found none")
    check_once([" and ".join(sorted(pair)) for pair in robot.self_pairs], "self_collision: pairs")
    check_once([hand.name for hand in robot.hands], "hand: name")
    for hand in robot.hands:
        if (len(robot.hands) > 1) != bool(_WORD.fullmatch(hand.name)) or hand.name in _TAKEN:
            words = "a name such as left of each of several, none of the only one"
            raise HandrailError(f"hand: expected {words}, got {hand.name!r}")
    fingers = [hand.gripper.shape for hand in robot.hands if hand.gripper]
    used = [*(name for pair in robot.self_pairs for name in pair), *fingers]
    check_known("collision shape", used, names)
    if same := [first for first, second in robot.self_pairs if first == second]:
        raise HandrailError(f"self_collision: pairs: expected two shapes, got {same[0]!r} twice")


def check_once(names: Sequence[str], where: str) -> None:
    """Check that no name is there twice."""
    if twice := [name for name in names if names.count(name) > 1]:
        raise HandrailError(f"{where}: expected each once, got {twice[0]!r} twice")

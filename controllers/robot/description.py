"""A robot is data: the description file that MuJoCo, pinocchio and CasADi are all built from."""

from dataclasses import dataclass
from importlib import metadata
from pathlib import Path, PurePosixPath
from typing import Any, Literal

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import matrix_from_rpy, matrix_to_axis
from handrail.controllers.regular_file import is_inside
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.description_check import check_description
from handrail.controllers.robot.shape import Shape, ShapeKind
from handrail.controllers.strict_toml import read_toml

_PLANAR = ("x", "y", "theta")
_BEYOND = 0.01  # touching, where fingers are sent to close [m]
_SIMPLE: tuple[ShapeKind, ...] = ("box", "sphere", "cylinder")


@dataclass(frozen=True)
class Placement:
    """A rigid transform: `p_parent = rotation @ p + translation` [m]."""

    translation: FloatArray  # (3,)
    rotation: FloatArray  # (3, 3)


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

    position_lower: FloatArray
    position_upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    effort: FloatArray
    servo: FloatArray


@dataclass(frozen=True)
class Jaw:
    """A finger that turns, instead of two that slide.

    Attributes:
        frame: of the URDF's link that turns, at the joint's zero, about its z axis; more angle is more open.
        closed: angle where it is closed [rad].
        open: angle where it is open [rad].
        parallel: angle at which its pad is parallel to the other finger's [rad].
        gap: from pad to pad there [m].
    """

    frame: str
    closed: float
    open: float
    parallel: float
    gap: float


@dataclass(frozen=True)
class Gripper:
    """Two fingers that slide along the x axis of a placement on a frame; lengths [m], force [N], speed [m/s].

    With a `jaw` the finger to +x stands still, its inner face at x = 0, and the one to −x turns.
    `shape` is the collision shape that encloses the fingers, open or closed: real ones stand in for it.
    """

    frame: str
    placement: Placement
    mass: float
    finger_mass: float
    finger_size: tuple[float, float, float]
    stroke: float
    tip: float
    force: float
    speed: float
    friction: float
    camera: tuple[float, float, float]
    camera_tilt: float
    shape: str = "fingers"
    jaw: Jaw | None = None

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
class EndEffector:
    """The end of an arm: the name of its channels, the frame that its placement is on, its gripper."""

    name: str
    frame: str
    placement: Placement
    gripper: Gripper | None


@dataclass(frozen=True)
class Base:
    """What the arm stands on: planar or fixed, its mass [kg], height, length and width [m]."""

    kind: Literal["planar", "fixed"]
    mass: float
    height: float
    size: tuple[float, float]

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of its coordinates; none where it is fixed."""
        return _PLANAR if self.kind == "planar" else ()


@dataclass(frozen=True)
class WorldScale:
    """How large the world is that a robot works in: tasks, sticks and margins are made to its measure.

    Attributes:
        scale: of lengths and speeds against those of a robot as large as a person.
        pace: share of full stick's speeds and rates; less than 1 where the base is slow for its size.
        tables: height of the lowest and of the highest table [m].
        goals: height of the lowest and of the highest goal of the hand [m].
        cube: edge of the cube that it carries [m].
        pitch: of goals of a hand on an arm of fewer than six joints: 0 points ahead, π/2 down [rad].
        roll: of such goals, about where the hand points [rad].
    """

    scale: float = 1.0
    pace: float = 1.0
    tables: tuple[float, float] = (0.55, 0.65)
    goals: tuple[float, float] = (0.7, 1.0)
    cube: float = 0.05
    pitch: tuple[float, float] = (0.0, 1.5)
    roll: tuple[float, float] = (-1.5, 1.5)

    @property
    def grip(self) -> float:
        """Scale of what the hand does close to a thing: of the cube against one of 5 cm."""
        return self.cube / 0.05


@dataclass(frozen=True)
class RobotDescription:
    """Everything that Handrail knows of a robot; see `robots/ridgeback_ur10.toml` for the format."""

    name: str
    base: Base
    urdf: Path
    mesh_root: Path
    mount: Placement
    arm_joints: tuple[str, ...]
    end_effector: EndEffector
    home: FloatArray
    limits: Limits
    collision: tuple[PlacedShape, ...]
    self_pairs: tuple[tuple[str, str], ...]
    self_margins: FloatArray  # largest margin that each self pair can keep [m]
    visual: tuple[PlacedShape, ...]
    world: WorldScale = WorldScale()

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of all generalised coordinates, base first."""
        return self.base.joints + self.arm_joints


def robot_names() -> list[str]:
    """Return the robots that come with Handrail, and those of installed packages."""
    return sorted(ROBOTS)


def load_description(robot: str | Path) -> RobotDescription:
    """Read a robot by name, by `module:name`, or from a description file."""
    path = Path(robot) if str(robot).endswith(".toml") else ROBOTS.find(str(robot)).file
    if not path.is_file():
        raise HandrailError(
            f"unknown robot {str(robot)!r}: expected a .toml file or one of {', '.join(robot_names())}"
        )
    content = read_toml(path, "robot description")
    check_description(content, f"robot description {path}")
    return _parse(content, path.parent)


def _parse(data: dict[str, Any], folder: Path) -> RobotDescription:
    urdf, mesh_root = _find_urdf(data["arm"]["urdf"], folder)
    gripper = data.get("gripper")
    self_collision = data["self_collision"]
    return RobotDescription(
        name=data["name"],
        base=Base(**_frozen_lists(data["base"])),
        urdf=urdf,
        mesh_root=mesh_root,
        mount=_placement(data["arm"]),
        arm_joints=tuple(data["arm"]["joints"]),
        end_effector=EndEffector(
            "ee", data["tool"]["frame"], _placement(data["tool"]), _gripper(gripper) if gripper else None
        ),
        home=frozen(data["home"]["q"]),
        limits=Limits(**{name: frozen(values) for name, values in data["limits"].items()}),
        collision=tuple(_placed_shape(entry) for entry in data["collision"]),
        self_pairs=tuple((first, second) for first, second, *_ in self_collision["pairs"]),
        self_margins=frozen([(*pair, np.inf)[2] for pair in self_collision["pairs"]]),
        visual=tuple(_placed_shape(entry) for entry in data.get("visual", [])),
        world=WorldScale(**_frozen_lists(data.get("world", {}))),
    )


def _gripper(data: dict[str, Any]) -> Gripper:
    apart = ("translation", "rpy", "jaw")
    values = _frozen_lists({name: value for name, value in data.items() if name not in apart})
    jaw = Jaw(**data["jaw"]) if "jaw" in data else None
    return Gripper(placement=_placement(data), jaw=jaw, **values)


def _frozen_lists(data: dict[str, Any]) -> dict[str, Any]:
    return {name: tuple(value) if isinstance(value, list) else value for name, value in data.items()}


def _placement(data: dict[str, Any], key: str = "translation") -> Placement:
    rotation = matrix_from_rpy(np.array(data.get("rpy", [0.0, 0.0, 0.0])))
    return Placement(frozen(data.get(key, [0.0, 0.0, 0.0])), frozen(rotation))


def _placed_shape(data: dict[str, Any]) -> PlacedShape:
    if "capsule" in data:
        shape, placement = _capsule(data)
    else:
        kind: ShapeKind = next(kind for kind in _SIMPLE if kind in data)
        shape, placement = Shape(kind, np.atleast_1d(data[kind])), _placement(data, "at")
    return PlacedShape(
        name=data.get("name", ""),
        frame=data["frame"],
        shape=shape,
        placement=placement,
        tool=data.get("tool", False),
        rgba=tuple(data.get("rgba", (0.5, 0.5, 0.5, 1.0))),
    )


def _capsule(data: dict[str, Any]) -> tuple[Shape, Placement]:
    a, b = np.array(data["a"], dtype=float), np.array(data["b"], dtype=float)
    length = float(np.linalg.norm(b - a))
    placement = Placement(frozen((a + b) / 2), frozen(matrix_to_axis((b - a) / length)))
    return Shape("capsule", np.array([data["capsule"], length])), placement


def _find_urdf(urdf: str, folder: Path) -> tuple[Path, Path]:
    """Return the URDF and the folder that its `package://` paths start from."""
    name = PurePosixPath(urdf)
    beside = folder / name
    if not name.parts or name.is_absolute() or ".." in name.parts or not is_inside(beside, folder):
        raise HandrailError(f"URDF {urdf}: expected a path inside a package, or beside the description")
    if beside.is_file():
        return beside, folder
    distribution = name.parts[0]
    try:
        files = metadata.files(distribution) or []
    except metadata.PackageNotFoundError:
        files = []
    for file in files:
        if PurePosixPath(file).parts[-len(name.parts) :] == name.parts:
            path = Path(str(file.locate())).resolve()
            return path, path.parents[len(name.parts) - 1]
    raise HandrailError(
        f"URDF {urdf}: expected it beside the description or in an installed package {distribution}, "
        "found it in neither"
    )

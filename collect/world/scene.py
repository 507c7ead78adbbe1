"""One scene, two uses: MuJoCo bodies for the simulation, obstacles for the controller."""

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np

from handrail.collect.world import geometry
from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.robot.description import check_once
from handrail.controllers.robot.model import Pose
from handrail.controllers.robot.shape import Obstacle, Shape

Colour = tuple[float, float, float, float]
_GREY: Colour = (0.6, 0.6, 0.6, 1.0)


@dataclass(frozen=True)
class FrozenArrays:
    """A value whose arrays are copied and made read-only."""

    def __post_init__(self) -> None:
        """Copy them."""
        for entry in fields(self):
            if entry.type == FloatArray:
                object.__setattr__(self, entry.name, frozen(getattr(self, entry.name)))


@dataclass(frozen=True)
class Patrol(FrozenArrays):
    """From a point to another at a constant speed, back, and again: a function of time alone."""

    start: FloatArray  # where it is at time 0 [m], (3,)
    end: FloatArray  # where it turns [m], (3,)
    speed: float  # [m/s]

    def __post_init__(self) -> None:
        """Check that it moves."""
        super().__post_init__()
        if not self.length > 0 or not 0 < self.speed < np.inf:
            raise HandrailError(
                "patrol: expected two points and a positive speed [m/s], "
                f"got {self.start.tolist()}, {self.end.tolist()} and {self.speed}"
            )

    @property
    def length(self) -> float:
        """Length of the way from start to end [m]."""
        return float(np.linalg.norm(self.end - self.start))

    def position(self, time: float) -> FloatArray:
        """Return where it is at a time [s], (3,) [m]."""
        travelled = (self.speed * time) % (2.0 * self.length)
        share = min(travelled, 2.0 * self.length - travelled) / self.length
        return (1.0 - share) * self.start + share * self.end

    def velocity(self, time: float) -> FloatArray:
        """Return how fast it moves at a time [s], (3,) [m/s]."""
        forth = (self.speed * time) % (2.0 * self.length) < self.length
        return (1.0 if forth else -1.0) * self.speed / self.length * (self.end - self.start)


@dataclass(frozen=True)
class Part(FrozenArrays):
    """A piece of an object: a shape at a place in the object's frame; `rgba` None takes the object's."""

    shape: Shape
    position: FloatArray
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    rgba: Colour | None = None


@dataclass(frozen=True)
class Slide(FrozenArrays):
    """A rail with stops at both ends, of a thing that slides: a drawer."""

    axis: FloatArray  # direction in which it opens, in the object's frame, a unit vector, (3,)
    travel: float  # from closed to open [m]
    damping: float = 8.0  # force per speed [N s/m]
    friction: float = 3.0  # force that it takes to move it [N]
    closing: float = 0.0  # force that closes it by itself [N]; 0: it stays where it is left


@dataclass(frozen=True)
class SceneObject(FrozenArrays):
    """A thing in the scene, by a name that is unique there."""

    name: str
    shape: Shape
    """The shape that the controller avoids; encloses the parts."""
    position: FloatArray
    """Of its centre in the world [m], (3,)."""
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    """World from object, (3, 3)."""
    rgba: Colour = _GREY
    mass: float = 0.0
    """Of a thing that can be moved [kg]; 0 stands still."""
    work_surface: bool = False
    """Whether the tool may come close to it."""
    ghost: bool = False
    """Drawn, never touched: a marker."""
    parts: tuple[Part, ...] = ()
    """The shapes that are drawn and touched, if not the shape itself."""
    friction: float = 0.8
    patrol: Patrol | None = None
    """How it moves by itself, from `position` on; nothing stops it."""
    slide: Slide | None = None
    """The rail that it moves on, for a movable thing that is not loose."""
    turns: int = 1
    """It looks the same after so many-th of a turn around its z axis."""

    @property
    def movable(self) -> bool:
        """Whether it can be pushed, pulled, grasped."""
        return self.mass > 0

    @property
    def top(self) -> float:
        """Height of its upper face above the floor [m], for an upright object."""
        return float(self.position[2] + geometry.bounding_box(self.shape)[2] / 2)

    @property
    def top_centre(self) -> FloatArray:
        """The centre of its upper face, (3,) [m], for an upright object."""
        return np.array([*self.position[:2], self.top])

    @property
    def front(self) -> float:
        """The x of its face towards the robot [m], for a box along the axes."""
        return float(self.position[0] - self.shape.size[0] / 2)

    @property
    def solids(self) -> tuple[Part, ...]:
        """The shapes that are drawn and touched."""
        return self.parts or (Part(self.shape, np.zeros(3)),)

    def carried(self, tool: Pose, now: Pose, frame: str = "tool") -> Obstacle:
        """Return it as the controller sees it while the hand holds it: the box around it, fixed to the tool.

        Args:
            tool: pose of the tool point.
            now: its own pose.
            frame: name of the tool's.
        """
        shape, centre = self._box
        inverse = tool.rotation.T
        position = inverse @ (now.position + now.rotation @ centre - tool.position)
        return Obstacle(self.name, shape, position, inverse @ now.rotation, frame=frame)

    def obstacle(self, time: float = 0.0) -> Obstacle:
        """Return it as the controller sees it at a time of the episode [s]."""
        if self.patrol is None:
            return self._still
        return replace(self._still, position=self.patrol.position(time), velocity=self.patrol.velocity(time))

    @cached_property
    def _still(self) -> Obstacle:
        return Obstacle(self.name, self.shape, self.position, self.rotation, work_surface=self.work_surface)

    @cached_property
    def _box(self) -> tuple[Shape, FloatArray]:
        """The box around it, and its centre, in its own frame."""
        size, centre = geometry.box_around((part.shape, part.position, part.rotation) for part in self.solids)
        return box(size), centre


@dataclass(frozen=True)
class Viewpoint:
    """A camera in the world: where it stands, what it looks at [m], vertical field of view [deg]."""

    position: tuple[float, float, float] = (-2.9, -2.6, 2.3)
    target: tuple[float, float, float] = (0.0, 0.0, 0.6)
    fovy: float = 50.0

    def scaled(self, scale: float) -> "Viewpoint":
        """Return the view of a world of another scale."""
        position, target = ((x * scale, y * scale, z * scale) for x, y, z in (self.position, self.target))
        return Viewpoint(position, target, self.fovy)


@dataclass(frozen=True)
class Scene:
    """Everything around the robot but the floor, and the camera that overlooks it."""

    objects: tuple[SceneObject, ...] = ()
    view: Viewpoint = field(default_factory=Viewpoint)

    def __post_init__(self) -> None:
        """Check the names."""
        check_once([item.name for item in self.objects], "names of objects in a scene")

    def find(self, name: str) -> SceneObject:
        """Return an object by name."""
        for item in self.objects:
            if item.name == name:
                return item
        raise unknown_name("scene object", name, [item.name for item in self.objects])

    @property
    def movables(self) -> tuple[SceneObject, ...]:
        """The things that can be moved."""
        return tuple(item for item in self.objects if item.movable)

    @property
    def movers(self) -> tuple[SceneObject, ...]:
        """The things that move by themselves."""
        return tuple(item for item in self.objects if item.patrol is not None)

    def obstacles(self, time: float = 0.0) -> tuple[Obstacle, ...]:
        """Return what the controller has to avoid at a time of the episode [s].

        Neither the floor, nor markers, nor movable things.
        """
        return tuple(item.obstacle(time) for item in self.objects if not (item.movable or item.ghost))


def box(size: Iterable[float]) -> Shape:
    """Return a box with full lengths [m]."""
    return Shape("box", np.array(list(size)))

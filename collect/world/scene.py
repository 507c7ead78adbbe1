"""One scene, two uses: MuJoCo bodies for the simulation, obstacles for the controller."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from handrail.collect.world import geometry
from handrail.collect.world.gl import MjsBody, MjSpec, mujoco
from handrail.collect.world.patrol import Patrol
from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.robot.model import Pose
from handrail.controllers.robot.shape import Obstacle, Shape

Colour = tuple[float, float, float, float]
_GREY: Colour = (0.6, 0.6, 0.6, 1.0)


@dataclass(frozen=True)
class Part:
    """A piece of an object: a shape at a place in the object's frame; `rgba` None takes the object's."""

    shape: Shape
    position: FloatArray
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    rgba: Colour | None = None

    def __post_init__(self) -> None:
        """Copy the arrays and make them read-only."""
        for name in ("position", "rotation"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True)
class Slide:
    """A rail with stops at both ends, of a thing that slides: a drawer.

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


@dataclass(frozen=True)
class SceneObject:
    """A thing in the scene.

    Attributes:
        name: unique in the scene.
        shape: what the controller avoids; encloses the parts.
        position: of its centre in the world [m], (3,).
        rotation: world from object, (3, 3).
        rgba: its colour.
        mass: of a thing that can be moved [kg]; 0 stands still.
        work_surface: whether the tool may come close to it.
        ghost: drawn, never touched: a marker.
        parts: what is drawn and touched, if not the shape itself.
        friction: sliding friction coefficient.
        patrol: how it moves by itself, from `position` on; nothing stops it.
        slide: the rail that it moves on, for a movable thing that is not loose.
    """

    name: str
    shape: Shape
    position: FloatArray
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    rgba: Colour = _GREY
    mass: float = 0.0
    work_surface: bool = False
    ghost: bool = False
    parts: tuple[Part, ...] = ()
    friction: float = 0.8
    patrol: Patrol | None = None
    slide: Slide | None = None

    def __post_init__(self) -> None:
        """Copy the arrays and make them read-only."""
        for name in ("position", "rotation"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def movable(self) -> bool:
        """Whether it can be pushed, pulled, grasped."""
        return self.mass > 0

    @property
    def top(self) -> float:
        """Height of its upper face above the floor [m], for an upright object."""
        return float(self.position[2] + geometry.bounding_box(self.shape)[2] / 2)

    @property
    def front(self) -> float:
        """The x of its face towards the robot [m], for a box along the axes."""
        return float(self.position[0] - self.shape.size[0] / 2)

    @property
    def portable(self) -> bool:
        """Whether the hand can carry it away."""
        return self.movable and self.slide is None

    def carried(self, tool: Pose, now: Pose) -> Obstacle:
        """Return it as the controller sees it while the hand holds it: the box around it, fixed to the tool.

        Args:
            tool: pose of the tool point.
            now: its own pose.
        """
        size, centre = geometry.box_around((part.shape, part.position, part.rotation) for part in self.solids)
        inverse = tool.rotation.T
        position = inverse @ (now.position + now.rotation @ centre - tool.position)
        return Obstacle(self.name, box(size), position, inverse @ now.rotation, frame="tool")

    @property
    def solids(self) -> tuple[Part, ...]:
        """What is drawn and touched."""
        return self.parts or (Part(self.shape, np.zeros(3)),)

    def obstacle(self, time: float = 0.0) -> Obstacle:
        """Return it as the controller sees it at a time of the episode [s]."""
        still = Obstacle(self.name, self.shape, self.position, self.rotation, work_surface=self.work_surface)
        if self.patrol is None:
            return still
        return replace(still, position=self.patrol.position(time), velocity=self.patrol.velocity(time))


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
        names = [item.name for item in self.objects]
        for name in names:
            if names.count(name) > 1:
                raise HandrailError(f"scene: expected unique object names, got {name!r} more than once")

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


def add_scene(spec: MjSpec, scene: Scene) -> None:
    """Add the objects and the scene camera to the spec."""
    for item in scene.objects:
        _add_object(spec, item)
    spec.worldbody.add_camera(name="scene", fovy=scene.view.fovy, **_view_pose(scene.view))


def _add_object(spec: MjSpec, item: SceneObject) -> None:
    placement = geometry.pose(item.position, item.rotation)
    body = spec.worldbody.add_body(name=item.name, mocap=item.patrol is not None, **placement)
    if item.movable:
        _add_freedom(body, item)
    volume = sum(geometry.volume(part.shape) for part in item.parts)
    for index, part in enumerate(item.solids):
        mass = item.mass * geometry.volume(part.shape) / volume if item.parts else 0.0
        body.add_geom(
            mass=mass,
            name=item.name if index == 0 else f"{item.name}_{index}",
            rgba=part.rgba or item.rgba,
            group=geometry.VISIBLE_GROUP,
            **geometry.geom_shape(part.shape),
            **geometry.pose(part.position, part.rotation),
            **_contact(item),
        )


def _add_freedom(body: MjsBody, item: SceneObject) -> None:
    """Let a movable thing move; its mass is spread over its parts, or over the box around it."""
    if item.slide is None:
        body.add_freejoint(name=item.name)
    else:
        body.add_joint(
            name=item.name,
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=item.slide.axis,
            limited=True,
            range=[0.0, item.slide.travel],
            damping=[item.slide.damping, 0.0, 0.0],
            frictionloss=item.slide.friction,
        )
    if not item.parts:
        body.explicitinertial = True
        body.mass, body.ipos, body.iquat = item.mass, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]
        body.inertia = geometry.box_inertia(item.mass, geometry.bounding_box(item.shape))


def _contact(item: SceneObject) -> dict[str, Any]:
    if item.ghost:
        return {"contype": 0, "conaffinity": 0}
    return {
        "contype": geometry.SCENE_BIT,
        "conaffinity": geometry.SCENE_BIT | (geometry.FLOOR_BIT if item.movable else 0),
        "condim": 4,
        "friction": [item.friction, 0.01, 0.0001],
    }


def _view_pose(view: Viewpoint) -> dict[str, FloatArray]:
    """Return the pose of a camera that looks along −z with y up."""
    position = np.array(view.position)
    forward = np.array(view.target) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right = right / np.linalg.norm(right) if np.any(right) else np.array([0.0, -1.0, 0.0])
    axes = np.column_stack([right, np.cross(right, forward), -forward])
    return geometry.pose(position, axes.astype(np.float64))


def box(size: Iterable[float]) -> Shape:
    """Return a box with full lengths [m]."""
    return Shape("box", np.array(list(size)))

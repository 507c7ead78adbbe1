"""Things that tasks put into scenes: tables, an open bin, cubes, a tray, obstacles on the floor."""

import numpy as np

from handrail.collect.world.scene import Colour, Part, Scene, SceneObject, box
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Shape

_WOOD: Colour = (0.72, 0.56, 0.40, 1.0)
_CABINET: Colour = (0.87, 0.86, 0.83, 1.0)
_WALL: Colour = (0.20, 0.42, 0.70, 1.0)
_CONE: Colour = (0.90, 0.45, 0.10, 1.0)
_STEEL: Colour = (0.45, 0.47, 0.50, 1.0)
_TRAY: Colour = (0.30, 0.55, 0.42, 1.0)

TRAY_BAR = 0.03  # width and height of a tray's handle [m]
MOST_OBSTACLES = 3
_PREFIX = "obstacle"
_QUANTITIES = ("x", "y", "radius", "height")


def table(name: str, x: float, y: float, size: tuple[float, float, float], scale: float = 1.0) -> SceneObject:
    """Return a solid table on the floor, centred at x, y; size is depth, width, height [m]."""
    depth, width, height = size
    slab, inset = 0.04 * scale, 0.03 * scale
    parts = (
        Part(box([depth, width, slab]), np.array([0.0, 0.0, (height - slab) / 2])),
        Part(
            box([depth - 2 * inset, width - 2 * inset, height - slab]),
            np.array([0.0, 0.0, -slab / 2]),
            rgba=_CABINET,
        ),
    )
    centre = np.array([x, y, height / 2])
    return SceneObject(name, box(size), centre, rgba=_WOOD, work_surface=True, parts=parts)


def cube(name: str, x: float, y: float, bottom: float, yaw: float, edge: float, mass: float) -> SceneObject:
    """Return a cube that can be grasped, standing at height `bottom` [m], turned by `yaw` [rad]."""
    return SceneObject(
        name,
        box([edge] * 3),
        np.array([x, y, bottom + edge / 2]),
        matrix_from_rpy([0.0, 0.0, yaw]),
        rgba=(0.85, 0.16, 0.14, 1.0),
        mass=mass,
        friction=1.0,
    )


def open_bin(
    name: str, x: float, y: float, bottom: float, inner: float, height: float, scale: float = 1.0
) -> SceneObject:
    """Return a square bin without a lid, 1 cm · scale thick; to the controller it is one box [m]."""
    wall = 0.01 * scale
    outer = inner + 2 * wall
    parts = [Part(box([outer, outer, wall]), np.array([0.0, 0.0, (wall - height) / 2]))]
    for sign in (-1.0, 1.0):
        offset = sign * (inner + wall) / 2
        parts.append(Part(box([wall, outer, height - wall]), np.array([offset, 0.0, wall / 2])))
        parts.append(Part(box([inner, wall, height - wall]), np.array([0.0, offset, wall / 2])))
    return SceneObject(
        name,
        box([outer, outer, height]),
        np.array([x, y, bottom + height / 2]),
        rgba=_WALL,
        work_surface=True,
        parts=tuple(parts),
    )


def pillar(name: str, x: float, y: float, radius: float, height: float) -> SceneObject:
    """Return a cylinder that stands on the floor [m]."""
    return SceneObject(
        name, Shape("cylinder", np.array([radius, height])), np.array([x, y, height / 2]), rgba=_CONE
    )


def crate(name: str, x: float, y: float, yaw: float, size: tuple[float, float, float]) -> SceneObject:
    """Return a box that stands on the floor; full lengths [m], turned by `yaw` [rad]."""
    return SceneObject(
        name,
        box(size),
        np.array([x, y, size[2] / 2]),
        matrix_from_rpy([0.0, 0.0, yaw]),
        rgba=(0.55, 0.58, 0.36, 1.0),
    )


def footprint(item: SceneObject) -> float:
    """Return the radius of the circle around an upright object, seen from above [m]."""
    size = item.shape.size
    return float(np.hypot(*size[:2]) / 2) if item.shape.kind == "box" else float(size[0])


def tray(
    name: str, handle: FloatArray, rotation: FloatArray, size: tuple[float, float, float], mass: float
) -> SceneObject:
    """Return a tray with a rim and an arched handle to hold it by from above.

    Its frame is at the centre of the plate's upper face, z up, the handle's bar along y.

    Args:
        name: unique in the scene.
        handle: centre of the handle's bar, (3,) [m].
        rotation: world from tray, (3, 3).
        size: length along x, width along y, height of the bar above the plate's upper face [m].
        mass: [kg].
    """
    length, width, height = size
    thick, rim, bar = 0.01, 0.012, TRAY_BAR
    side, end = (length / 2 - thick / 2, 0.0), (0.0, width / 2 - thick / 2)
    parts = [Part(box([length, width, thick]), np.array([0.0, 0.0, -thick / 2]))]
    for sign in (-1.0, 1.0):
        parts.append(Part(box([thick, width, rim]), np.array([sign * side[0], side[1], rim / 2])))
        parts.append(Part(box([length - 2 * thick, thick, rim]), np.array([end[0], sign * end[1], rim / 2])))
        post = np.array([0.0, sign * end[1], (rim + height) / 2])
        parts.append(Part(box([bar, thick, height - rim]), post, rgba=_STEEL))
    parts.append(Part(box([bar, width, bar]), np.array([0.0, 0.0, height]), rgba=_STEEL))
    shape = box([length, width, 2 * (height + bar)])
    position = handle - rotation @ np.array([0.0, 0.0, height])
    return SceneObject(
        name, shape, position, rotation, rgba=_TRAY, mass=mass, parts=tuple(parts), friction=0.35
    )


def can(name: str, position: FloatArray, radius: float, height: float, mass: float) -> SceneObject:
    """Return an upright can centred at a place, (3,) [m]."""
    shape = Shape("cylinder", np.array([radius, height]))
    return SceneObject(name, shape, position, rgba=(0.85, 0.16, 0.14, 1.0), mass=mass, friction=0.35)


def obstacle_names() -> tuple[str, ...]:
    """Return the names of what `obstacle_features` returns, (12,)."""
    return tuple(
        f"{_PREFIX}_{index}.{quantity}" for index in range(MOST_OBSTACLES) for quantity in _QUANTITIES
    )


def obstacle_features(scene: Scene) -> FloatArray:
    """Return place, radius and height of the obstacles [m], (12,); absent ones are all zero."""
    numbers = np.zeros((MOST_OBSTACLES, len(_QUANTITIES)))
    for row, item in zip(numbers, floor_obstacles(scene), strict=False):
        row[:] = (*item.position[:2], footprint(item), item.top)
    return numbers.ravel()


def floor_obstacles(scene: Scene) -> tuple[SceneObject, ...]:
    """Return the obstacles on the floor of a scene."""
    return tuple(item for item in scene.objects if item.name.startswith(_PREFIX))


def sample_obstacles(
    model: RobotModel, q: FloatArray, rng: np.random.Generator, clearance: float
) -> list[SceneObject]:
    """Draw two or three obstacles; reject those that overlap another or come close to the robot's start.

    Args:
        model: of the robot.
        q: where it starts, (n,).
        rng: drawn from.
        clearance: between the robot's start and an obstacle, and between obstacles, at scale 1 [m].
    """
    wanted = int(rng.integers(2, MOST_OBSTACLES + 1))
    start, reach = _start_circle(model, q)
    scale = model.description.world.scale
    placed: list[SceneObject] = []
    for _ in range(1000):
        if len(placed) == wanted:
            return placed
        item = _sample_obstacle(f"{_PREFIX}_{len(placed)}", scale, rng)
        circles = [(start, reach), *((other.position[:2], footprint(other)) for other in placed)]
        if all(
            np.linalg.norm(item.position[:2] - centre) > radius + footprint(item) + clearance * scale
            for centre, radius in circles
        ):
            placed.append(item)
    raise HandrailError(
        f"scene: no room for {wanted} obstacles around robot {model.description.name}, "
        f"which starts at {start.round(2).tolist()}, with {clearance} m between them"
    )


def _sample_obstacle(name: str, scale: float, rng: np.random.Generator) -> SceneObject:
    x, y = scale * rng.uniform([-0.4, -0.45], [0.5, 0.45])
    height = scale * rng.uniform(0.2, 0.5)
    if rng.random() < 0.6:
        return pillar(name, x, y, scale * rng.uniform(0.10, 0.18), height)
    width, depth = scale * rng.uniform(0.16, 0.26, 2)
    return crate(name, x, y, rng.uniform(-np.pi / 4, np.pi / 4), (width, depth, height))


def _start_circle(model: RobotModel, q: FloatArray) -> tuple[FloatArray, float]:
    """Return a circle around the chassis where it starts: centre (2,) and radius [m]."""
    base = model.pose(q, "planar_base").position[:2]
    return base, float(np.hypot(*model.description.base.size) / 2)

"""Obstacles on the floor: what they look like, where they may be, and how a task shows them."""

import numpy as np

from handrail.collect.world.scene import Scene, SceneObject
from handrail.collect.world.tasks.furniture import crate, footprint, pillar
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import RobotModel

MOST_OBSTACLES = 3
_PREFIX = "obstacle"
_QUANTITIES = ("x", "y", "radius", "height")


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
    return base, float(np.hypot(*model.description.base_size) / 2)

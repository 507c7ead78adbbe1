"""Obstacles on the floor: drawn, and as numbers."""

import numpy as np

from handrail.collect.world.observation import padded, row_names
from handrail.collect.world.scene import Scene, SceneObject, box
from handrail.collect.world.tasks.furniture import CRATE, footprint, pillar, standing
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import RobotModel

CLEARANCE = 0.15  # of the robot's start and obstacles from each other, at scale 1 [m]
_MOST = 3
_PREFIX = "obstacle"
_QUANTITIES = ("x", "y", "radius", "height")


def obstacle_names() -> tuple[str, ...]:
    """Return the names of what `obstacle_features` returns, (12,)."""
    return row_names(_PREFIX, _MOST, _QUANTITIES)


def obstacle_features(scene: Scene) -> FloatArray:
    """Return place, radius and height of the obstacles [m], (12,); absent ones are all zero."""
    rows = [(*item.position[:2], footprint(item), item.top) for item in floor_obstacles(scene)]
    return padded(rows, _MOST, len(_QUANTITIES))


def floor_obstacles(scene: Scene) -> tuple[SceneObject, ...]:
    """Return the obstacles on the floor of a scene."""
    return tuple(item for item in scene.objects if item.name.startswith(_PREFIX))


def sample_obstacles(model: RobotModel, q: FloatArray, rng: np.random.Generator) -> list[SceneObject]:
    """Draw two or three obstacles; reject those that overlap another or come close to the robot's start.

    Args:
        model: of the robot.
        q: where it starts, (n,).
        rng: drawn from.
    """
    wanted = int(rng.integers(2, _MOST + 1))
    start, scale = model.pose(q, "planar_base").position[:2], model.description.world.scale
    circles = [(start, float(np.hypot(*model.description.base.size) / 2))]  # the chassis, then obstacles
    placed: list[SceneObject] = []
    for _ in range(1000):
        if len(placed) == wanted:
            return placed
        item = _sample_obstacle(f"{_PREFIX}_{len(placed)}", scale, rng)
        at, size = item.position[:2], footprint(item)
        if all(np.linalg.norm(at - centre) > radius + size + CLEARANCE * scale for centre, radius in circles):
            placed.append(item)
            circles.append((at, size))
    raise HandrailError(
        f"scene: no room for {wanted} obstacles around robot {model.description.name}, "
        f"which starts at {start.round(2).tolist()}, with {CLEARANCE} m between them"
    )


def _sample_obstacle(name: str, scale: float, rng: np.random.Generator) -> SceneObject:
    x, y = scale * rng.uniform([-0.4, -0.45], [0.5, 0.45])
    height = scale * rng.uniform(0.2, 0.5)
    if rng.random() < 0.6:
        return pillar(name, x, y, scale * rng.uniform(0.10, 0.18), height)
    width, depth = scale * rng.uniform(0.16, 0.26, 2)
    yaw = rng.uniform(-np.pi / 4, np.pi / 4)
    return standing(name, box([width, depth, height]), x, y, yaw=yaw, rgba=CRATE)

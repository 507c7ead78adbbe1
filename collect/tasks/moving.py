"""Obstacles that cross the robot's way at a constant velocity, for tasks that want them."""

import numpy as np

from handrail.collect.simulation.patrol import Patrol
from handrail.collect.simulation.scene import Scene, SceneObject
from handrail.collect.tasks.furniture import footprint
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Shape

FASTEST = 0.5  # [m/s]
_SLOWEST = 0.2  # [m/s]
_APART = 1.2  # of a lane's start from the robot's base [m]
_QUANTITIES = ("x", "y", "vx", "vy", "radius", "height")
_COLOUR = (0.80, 0.20, 0.45, 1.0)


def mover_names(count: int) -> tuple[str, ...]:
    """Return the names of what `mover_features` returns, (6 count,)."""
    return tuple(f"mover_{index}.{quantity}" for index in range(count) for quantity in _QUANTITIES)


def mover_features(scene: Scene, time: float, count: int) -> FloatArray:
    """Return place [m], velocity [m/s], radius and height [m] of the movers at a time [s], (6 count,).

    Zero for those that a scene of one's own does not have.
    """
    numbers = np.zeros((count, len(_QUANTITIES)))
    for row, item in zip(numbers, scene.movers, strict=False):
        obstacle = item.obstacle(time)
        row[:] = (*obstacle.position[:2], *obstacle.velocity[:2], footprint(item), item.top)
    return numbers.ravel()


def sample_movers(
    count: int, model: RobotModel, q: FloatArray, rng: np.random.Generator
) -> list[SceneObject]:
    """Draw cylinders that pass through the workspace's middle, in any direction, at up to 0.5 m/s · scale.

    Args:
        count: how many.
        model: of the robot.
        q: where the robot starts, (n,); no mover starts near its base.
        rng: drawn from.
    """
    base, scale = model.pose(q, "planar_base").position[:2], model.description.world.scale
    movers: list[SceneObject] = []
    while len(movers) < count:
        item = _sample_mover(f"mover_{len(movers)}", scale, rng)
        if np.linalg.norm(item.position[:2] - base) > _APART * scale + footprint(item):
            movers.append(item)
    return movers


def _sample_mover(name: str, scale: float, rng: np.random.Generator) -> SceneObject:
    """Return a mover from 1.5 to 2 m · scale before a point of the workspace to 3 m · scale behind it."""
    radius, height = scale * rng.uniform(0.1, 0.2), scale * rng.uniform(0.3, 1.5)
    angle = rng.uniform(-np.pi, np.pi)
    ahead = np.array([np.cos(angle), np.sin(angle), 0.0])
    middle = np.array([*(scale * rng.uniform([-1.2, -0.8], [0.6, 0.8])), height / 2])
    start, end = middle - scale * rng.uniform(1.5, 2.0) * ahead, middle + 3.0 * scale * ahead
    patrol = Patrol(start, end, scale * rng.uniform(_SLOWEST, FASTEST))
    return SceneObject(
        name, Shape("cylinder", np.array([radius, height])), start, rgba=_COLOUR, patrol=patrol
    )

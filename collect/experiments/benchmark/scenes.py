"""Where the benchmark takes place: an empty floor, or one with cylinders on it."""

import numpy as np

from handrail.collect.simulation.scene import Scene, SceneObject, Viewpoint
from handrail.collect.tasks.furniture import footprint, pillar
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import Pose, RobotModel

VIEW = Viewpoint(position=(-2.9, -3.4, 3.0), target=(-0.3, 0.0, 0.4), fovy=36.0)
_LOW, _TALL = (0.3, 0.3), (0.25, 1.5)  # radius and height of the showcase's cylinders [m]
_COUNTS = ((2, _LOW), (1, _TALL))
_AREA = (-1.2, -1.2), (1.2, 1.2)  # of their centres [m]
_CLEAR_START = 0.2  # of the robot at home [m]
_CLEAR_HAND = 0.6  # of a tall one from the hand's straight way, seen from above [m]
_CLEAR_EACH_OTHER = 0.2  # [m]
_TRIES = 2000


def empty_floor() -> Scene:
    """Return the protocol's own scene."""
    return Scene(view=VIEW)


def cluttered_floor(model: RobotModel, goal: Pose, rng: np.random.Generator) -> Scene:
    """Draw two low cylinders and a tall one, clear of the robot's start, of the hand's way and of each other.

    Low ones stand in the way of the base, tall ones in the way of the arm; the straight way of the hand from
    home to the goal is free, so that a goal can be reached.

    Args:
        model: of the robot.
        goal: where the hand will go.
        rng: of places.

    Raises:
        HandrailError: there is no room.
    """
    hand = model.pose(model.description.home).position[:2]
    placed: list[SceneObject] = []
    for count, (radius, height) in _COUNTS:
        clear = _CLEAR_HAND if height > goal.position[2] - radius else 0.0
        for _ in range(count):
            placed.append(_place(model, placed, (radius, height), (hand, goal.position[:2], clear), rng))
    return Scene(tuple(placed), VIEW)


def _place(
    model: RobotModel,
    placed: list[SceneObject],
    size: tuple[float, float],
    way: tuple[FloatArray, FloatArray, float],
    rng: np.random.Generator,
) -> SceneObject:
    start, end, clear = way
    for _ in range(_TRIES):
        x, y = rng.uniform(*_AREA)
        item = pillar(f"cylinder_{len(placed)}", x, y, *size)
        centre = np.array([x, y])
        apart = all(
            np.linalg.norm(other.position[:2] - centre) - footprint(other) - size[0] >= _CLEAR_EACH_OTHER
            for other in placed
        )
        if apart and (not clear or _distance_to_line(centre, start, end) >= clear) and _free(model, item):
            return item
    raise HandrailError(f"cluttered floor: no room for cylinder {len(placed)} after {_TRIES} tries")


def _free(model: RobotModel, item: SceneObject) -> bool:
    """Whether an object is clear of the robot at home."""
    collision = CollisionModel(model, (item.obstacle(),))
    distances = collision.values(model.description.home[None])[0]
    return all(
        distance >= _CLEAR_START
        for distance, pair in zip(distances, collision.pairs, strict=True)
        if pair[1] == item.name
    )


def _distance_to_line(point: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Return the distance of a point from a line segment, in the plane [m]."""
    line = end - start
    share = float(np.clip((point - start) @ line / max(float(line @ line), 1e-12), 0.0, 1.0))
    return float(np.linalg.norm(point - start - share * line))

"""Where the benchmark takes place: on an empty floor or among cylinders, ideally or in physics."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from handrail.collect.world.ideal_robot import IdealRobot
from handrail.collect.world.plant import Gate, Plant
from handrail.collect.world.scene import Scene, SceneObject, Viewpoint
from handrail.collect.world.simulation import Simulation
from handrail.collect.world.tasks.furniture import footprint, pillar
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Obstacle

VIEW = Viewpoint(position=(-2.9, -3.4, 3.0), target=(-0.3, 0.0, 0.4), fovy=36.0)
_CYLINDERS = ((0.3, 0.3), (0.3, 0.3), (0.25, 1.5))  # radius and height, as in the showcase [m]
_AREA = (-1.2, -1.2), (1.2, 1.2)  # of their centres [m]
_CLEAR_START = 0.2  # of the robot at home [m]
_CLEAR_HAND = 0.6  # of a tall one from the hand's straight way, seen from above [m]
_CLEAR_EACH_OTHER = 0.2  # [m]
_TRIES = 2000
PHYSICS: Mapping[str, Any] = {"grips": False, "timestep": 0.005}
"""MuJoCo's robot: its fingers do not move, and the integrator's longest step [s]."""


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
    """
    hand = model.pose(model.description.home).position[:2]
    placed: list[SceneObject] = []
    for radius, height in _CYLINDERS:
        tall = height > goal.position[2] - radius
        for _ in range(_TRIES):
            x, y = rng.uniform(*_AREA)
            item = pillar(f"cylinder_{len(placed)}", x, y, radius, height)
            passes = not tall or _distance_to_line(item.position[:2], hand, goal.position[:2]) >= _CLEAR_HAND
            apart = all(_between(item, other) >= _CLEAR_EACH_OTHER for other in placed)
            if passes and apart and clearance(model, item.obstacle()) >= _CLEAR_START:
                placed.append(item)
                break
        else:
            raise HandrailError(f"cluttered floor: no room for cylinder {len(placed)} after {_TRIES} tries")
    return Scene(tuple(placed), VIEW)


def _between(one: SceneObject, other: SceneObject) -> float:
    """Return how far apart two cylinders stand [m]."""
    way = float(np.linalg.norm(other.position[:2] - one.position[:2]))
    return way - (footprint(other) + footprint(one))


def clearance(model: RobotModel, obstacle: Obstacle) -> float:
    """Return how far an obstacle is from the robot at home [m]."""
    collision = CollisionModel(model, (obstacle,))
    distances = collision.values(model.description.home[None])[0]
    return min(d for d, pair in zip(distances, collision.pairs, strict=True) if pair[1] == obstacle.name)


def _distance_to_line(point: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Return the distance of a point from a line segment, in the plane [m]."""
    line = end - start
    share = float(np.clip((point - start) @ line / max(float(line @ line), 1e-12), 0.0, 1.0))
    return float(np.linalg.norm(point - start - share * line))


def plant(physics: bool) -> Callable[..., Plant]:
    """Return what makes the robot, which is sent every digit.

    MuJoCo's gripper stays open, for nothing is grasped, and without a grasp steps of 5 ms do: on six goals,
    compared with steps of 0.5 ms, no path of the hand under `mpc`, `dls` or `rl` differs by more than 1.1 mm,
    no effort by more than 0.5 %; on 300 goals, compared with 2 ms and moving fingers, ten controllers touch
    something in as many episodes, but for one of `rl`.
    """

    def made(model: RobotModel, scene: Scene, q: FloatArray, step: float, **settings: Any) -> Plant:
        gate = Gate(model, step, precision=np.float64)
        if physics:
            return Simulation(model, scene, q, step, **PHYSICS, **settings, gate=gate)
        return IdealRobot(model, scene, q, step, **settings, gate=gate)

    return made

"""Random scenes close around a robot, and intents that steer it at them."""

from dataclasses import replace

import numpy as np

from handrail.collect.experiments.benchmark.scenes import clearance
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.description import load_description
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle, Shape

_NEAREST, _FARTHEST = 0.12, 0.30  # between robot and obstacle at home [m]
_SPEED = 0.4  # [m/s, rad/s]
_MODES = (("ee",), ("base",), ("base", "ee"), ("joint",))


def robot_for(robot: str, pairs: str) -> RobotModel:
    """Return a robot with `all` its own pairs, `few` or `none` at all (it then meets no obstacle either)."""
    description = load_description(robot)
    if pairs == "none":
        description = replace(
            description, gripper=None, collision=(), self_pairs=(), self_margins=np.zeros(0)
        )
    elif pairs == "few":
        few = slice(None, None, 4)
        description = replace(
            description, self_pairs=description.self_pairs[few], self_margins=description.self_margins[few]
        )
    return RobotModel(description)


def random_scene(model: RobotModel, count: int, rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """Return obstacles of all kinds, each 0.12 to 0.3 m from the robot at home."""
    home = model.description.home
    obstacles: list[Obstacle] = []
    while len(obstacles) < count:
        obstacle = _random_obstacle(f"obstacle_{len(obstacles)}", home, rng)
        if _NEAREST < clearance(model, obstacle) < _FARTHEST:
            obstacles.append(obstacle)
    return tuple(obstacles)


def _random_obstacle(name: str, home: FloatArray, rng: np.random.Generator) -> Obstacle:
    shape = (
        Shape("box", rng.uniform(0.1, 0.5, 3)),
        Shape("cylinder", rng.uniform([0.05, 0.2], [0.2, 0.8])),
        Shape("capsule", rng.uniform([0.04, 0.2], [0.15, 0.6])),
        Shape("sphere", rng.uniform(0.05, 0.2, 1)),
    )[rng.integers(4)]
    position = np.append(home[:2], 0.0) + rng.uniform([-1.2, -1.2, 0.1], [1.6, 1.2, 1.4])
    return Obstacle(name, shape, position, turned(np.eye(3), rng.uniform(-np.pi, np.pi)))


def random_intent(
    model: RobotModel, state: State, obstacles: tuple[Obstacle, ...], rng: np.random.Generator
) -> Intent:
    """Return an intent in one mode or another: random, and towards an obstacle where there is one."""
    channels = Channels.of(model.description)
    mask = channels.mask(*(group for group in _MODES[rng.integers(len(_MODES))] if group != "base"))
    mask[channels.base_slice] = bool(channels.base) and rng.random() < 0.5
    values = rng.uniform(-_SPEED, _SPEED, channels.size)
    if obstacles:
        target = obstacles[rng.integers(len(obstacles))].position
        values[channels.tool_slice][:3] = _SPEED * _unit(target - model.pose(state.q).position)
        if channels.base:
            values[:2] = _SPEED * turned(_unit(target[:2] - state.q[:2]), -state.q[2])
    return Intent(np.where(mask, values, 0.0), mask, time=state.time)


def _unit(vector: FloatArray) -> FloatArray:
    return vector / max(float(np.linalg.norm(vector)), 1e-9)

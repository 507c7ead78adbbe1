"""A start elsewhere: the robot begins away from where demonstrations began."""

from dataclasses import replace

import numpy as np

from handrail.collect.world.scene import Scene, SceneObject
from handrail.collect.world.tasks.task import Start, Task
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.robot.model import RobotModel

_CLEARANCE = 0.08  # of the start from everything, unless it was nearer before [m]
_ATTEMPTS = 100


def sample_shifted(task: Task, size: float, model: RobotModel, rng: np.random.Generator) -> Start:
    """Draw a task's beginning, then where the robot is instead; scene and goal of a seed stay what they are.

    With size s the base begins `s/2` to s metres away in any direction and turned by up to s rad, each joint
    of the arm by up to `s/2` rad. What the gripper holds comes along, and the arm then stays as it is. The
    start is inside the limits and keeps 8 cm from everything; where there is no room the shift becomes
    smaller.

    Args:
        task: which.
        size: s [m, rad].
        model: of the robot.
        rng: drawn from.
    """
    start = task.sample(model, rng)
    least = np.minimum(_distances(model, start), _CLEARANCE)
    for attempt in range(_ATTEMPTS):
        step = _draw(len(model.description.base_joints), model.size, size * (1.0 - attempt / _ATTEMPTS), rng)
        moved = _moved(model, start, step)
        if _inside(model, moved.q) and np.all(_distances(model, moved) >= least):
            return moved
    return start


def _draw(base: int, joints: int, size: float, rng: np.random.Generator) -> FloatArray:
    """Return a displacement of the configuration, (n,)."""
    step = rng.uniform(-size / 2, size / 2, joints)
    direction, distance = rng.uniform(-np.pi, np.pi), rng.uniform(size / 2, size)
    turn = rng.uniform(-1, 1)
    step[:base] = np.array([np.cos(direction), np.sin(direction), 0.0])[:base] * distance
    if base == 3:
        step[2] = size * turn
    return step


def _moved(model: RobotModel, start: Start, step: FloatArray) -> Start:
    """Return the start with the robot displaced; what it holds moves with the hand."""
    if start.grip is None:
        return replace(start, q=start.q + step)
    q = start.q + np.where(np.arange(model.size) < len(model.description.base_joints), step, 0.0)
    before, after = model.pose(start.q), model.pose(q)
    turn = after.rotation @ before.rotation.T

    def carried(item: SceneObject) -> SceneObject:
        if not item.movable:
            return item
        position = after.position + turn @ (item.position - before.position)
        return replace(item, position=position, rotation=turn @ item.rotation)

    return replace(start, q=q, scene=Scene(tuple(map(carried, start.scene.objects)), start.scene.view))


def _inside(model: RobotModel, q: FloatArray) -> bool:
    limits = model.description.limits
    return bool(np.all((limits.position_lower < q) & (q < limits.position_upper)))


def _distances(model: RobotModel, start: Start) -> FloatArray:
    """Return the signed distance of every pair, things that can be moved included [m], (P,)."""
    solid = tuple(item.obstacle() for item in start.scene.objects if not item.ghost)
    return CollisionModel(model, solid).values(start.q[None, :])[0]

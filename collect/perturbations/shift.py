"""A task that begins elsewhere: the robot starts away from where demonstrations began."""

from dataclasses import dataclass, replace

import numpy as np

from handrail.collect.simulation.scene import Scene, SceneObject
from handrail.collect.tasks.task import Episode, Task, TaskState, Verdict
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.robot.model import RobotModel

_CLEARANCE = 0.08  # of the start from everything, unless it was nearer before [m]
_ATTEMPTS = 100


@dataclass(frozen=True)
class ShiftedTask:
    """A task whose robot starts elsewhere; scene and goal of a seed stay what they are.

    With size s the base begins `s/2` to s metres away in any direction and turned by up to s rad, each joint
    of the arm by up to `s/2` rad. What the gripper holds comes along, and the arm then stays as it is. The
    start is inside the limits and keeps 8 cm from everything; where there is no room the shift becomes
    smaller.

    Args:
        task: which.
        size: s [m, rad].
    """

    task: Task
    size: float

    @property
    def description(self) -> str:
        """What the operator is asked to do."""
        return self.task.description

    @property
    def horizon(self) -> float:
        """Time limit [s]."""
        return self.task.horizon

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the task's state."""
        return self.task.state_names

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Episode:
        """Draw the task's beginning, then where the robot is instead."""
        episode = self.task.sample(model, rng)
        least = np.minimum(_distances(model, episode), _CLEARANCE)
        for attempt in range(_ATTEMPTS):
            moved = _moved(model, episode, self._draw(model, episode, rng, 1.0 - attempt / _ATTEMPTS))
            if _inside(model, moved.q) and np.all(_distances(model, moved) >= least):
                return moved
        return episode

    def features(self, state: TaskState) -> FloatArray:
        """Return the task's state."""
        return self.task.features(state)

    def outcome(self, state: TaskState) -> Verdict:
        """Judge as the task does."""
        return self.task.outcome(state)

    def _draw(
        self, model: RobotModel, episode: Episode, rng: np.random.Generator, share: float
    ) -> FloatArray:
        """Return a displacement of the configuration, (n,)."""
        size, base = self.size * share, len(model.description.base_joints)
        step = rng.uniform(-size / 2, size / 2, model.size)
        direction, distance, turn = (
            rng.uniform(-np.pi, np.pi),
            rng.uniform(size / 2, size),
            rng.uniform(-1, 1),
        )
        step[:base] = np.array([np.cos(direction), np.sin(direction), 0.0])[:base] * distance
        if base == 3:
            step[2] = size * turn
        if episode.grip is not None:
            step[base:] = 0.0
        return step


def _moved(model: RobotModel, episode: Episode, step: FloatArray) -> Episode:
    """Return the episode with the robot displaced; what it holds moves with the hand."""
    q = episode.q + step
    if episode.grip is None:
        return replace(episode, q=q)
    before, after = model.pose(episode.q), model.pose(q)
    turn = after.rotation @ before.rotation.T

    def carried(item: SceneObject) -> SceneObject:
        if not item.movable:
            return item
        position = after.position + turn @ (item.position - before.position)
        return replace(item, position=position, rotation=turn @ item.rotation)

    return replace(episode, q=q, scene=Scene(tuple(map(carried, episode.scene.objects)), episode.scene.view))


def _inside(model: RobotModel, q: FloatArray) -> bool:
    limits = model.description.limits
    return bool(np.all((limits.position_lower < q) & (q < limits.position_upper)))


def _distances(model: RobotModel, episode: Episode) -> FloatArray:
    """Return the signed distance of every pair, things that can be moved included [m], (P,)."""
    solid = tuple(item.obstacle() for item in episode.scene.objects if not item.ghost)
    return CollisionModel(model, solid).values(episode.q[None, :])[0]

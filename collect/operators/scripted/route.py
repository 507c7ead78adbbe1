"""How an operator drives among tables and things on the floor, towards +x."""

import numpy as np

from handrail.collect.operators.scripted.base_placement import standing_point
from handrail.collect.operators.scripted.phases import ScriptPhase
from handrail.collect.world.tasks.clutter import floor_obstacles
from handrail.collect.world.tasks.task import TaskState
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import Pose, RobotModel

_FROM_ABOVE = 0.7  # of the reach at home: comfortable where the hand points down
_CLEARANCE = 0.25  # of the chassis behind the floor obstacles, and before a table at scale 1 [m]


class Route:
    """Where to stand at a table, and how to get there.

    Args:
        model: of the robot.
        task: the scene.

    Attributes:
        lane: the x in which the base passes behind everything on the floor [m].
    """

    def __init__(self, model: RobotModel, task: TaskState) -> None:
        self._model, self._scale = model, model.description.world.scale
        self._clearance = _CLEARANCE * self._scale
        self._obstacles = floor_obstacles(task.start.scene)
        behind = [item.position[0] - np.hypot(*item.shape.size[:2]) / 2 for item in self._obstacles]
        self.lane = float(min(behind, default=0.0)) - model.description.base_size[0] / 2 - self._clearance

    def stand(self, place: FloatArray, edge: float) -> FloatArray:
        """Return where the base stands to work at a place, (3,): comfortable, and clear of the table.

        Args:
            place: what is worked at, (3,) [m].
            edge: the x of the table's near edge [m].
        """
        base = standing_point(self._model, place, comfort=_FROM_ABOVE)
        length = self._model.description.base_size[0]
        base[0] = min(base[0], edge - length / 2 - self._clearance)
        return base

    def drive(self, start: FloatArray, goal: FloatArray, hand: Pose, gripper: float) -> list[ScriptPhase]:
        """Return the phases that drive in the lane, then up to the goal, (3,)."""
        points, near = [goal], 0.12 * self._scale
        if abs(goal[1] - start[1]) > 0.3 * self._scale:
            back, across = (np.array([min(self.lane, start[0]), y, 0.0]) for y in (start[1], goal[1]))
            points = [back, across, goal] if start[0] > self.lane else [across, goal]
        return [
            ScriptPhase(hand, point, name="drive", focus="base", gripper=gripper, distance=near, angle=0.15)
            for point in points
        ]

    def blocked(self, start: FloatArray, goal: FloatArray) -> bool:
        """Return whether something on the floor is in the chassis' way between two places, (2,) each."""
        width = np.hypot(*self._model.description.base_size) / 2 + self._clearance / 2
        for item in self._obstacles:
            along = np.clip(
                (item.position[:2] - start) @ (goal - start) / max(np.sum((goal - start) ** 2), 1e-9), 0, 1
            )
            gap = np.linalg.norm(item.position[:2] - start - along * (goal - start))
            if gap < width + np.hypot(*item.shape.size[:2]) / 2:
                return True
        return False

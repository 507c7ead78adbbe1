"""A script made of phases: go there, with the hand or the base, then the next; routes among tables."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handrail.collect.operators.modes import Focus
from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted import steering
from handrail.collect.operators.scripted.placement import standing_point
from handrail.collect.world.task import TaskState
from handrail.collect.world.tasks.obstacles import floor_obstacles
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import Pose, RobotModel

_FROM_ABOVE = 0.7  # of the reach at home: comfortable where the hand points down
_ROUTE_CLEARANCE = 0.25  # of the chassis behind the floor obstacles, and before a table at scale 1 [m]


@dataclass(frozen=True)
class ScriptPhase(steering.Target):
    """One thing to do: get the hand, or the base, to a target."""

    name: str = ""  # what it is, for whoever plans anew after it
    focus: Focus = "hand"  # which of the two ends the phase, and is steered in switching mode
    gripper: float = 0.0  # 0 open, 1 closed; of a pair, of the hand that begins the task
    other: float | None = None  # the other hand's; None: open, and of a pair the same
    beside: float = 0.0  # `distance` across the tool's axis, where more is good enough there [m]
    dwell: float = 0.0  # time to wait, hands still, before the next phase [s]
    patience: float = np.inf  # time after which the operator goes on anyway [s]

    @classmethod
    def at(
        cls, name: str, position: FloatArray, rotation: FloatArray, base: FloatArray, **options: Any
    ) -> "ScriptPhase":
        """Return the phase that brings the hand to a place, (3,), with a rotation, (3, 3)."""
        return cls(Pose(position, rotation), base, name=name, **options)

    def is_reached(self, view: View) -> bool:
        """Return whether the base, or the hand, is near enough."""
        if self.focus == "base":
            *way, turn = steering.base_errors(view.state.q, self.base)
            return bool(np.hypot(*way) < self.distance and abs(turn) < self.angle)
        tool = self.steered(view.task)
        distance, angle = steering.pose_errors(tool, self.hand)
        if self.beside:
            *across, along = tool.rotation.T @ (tool.position - self.hand.position)
            distance = max(abs(along), np.hypot(*across) * self.distance / self.beside)
        return bool(distance < self.distance and angle < self.angle)


class PhasedScript(ABC):
    """Does one phase after the other; a script.

    Args:
        model: of the robot.
        gains: of the operator.
        drives: whether the operator drives the base by itself from place to place.
    """

    def __init__(self, model: RobotModel, gains: steering.Gains, drives: bool) -> None:
        self._model, self._gains, self._drives = model, gains, drives
        self._scale, self._grip = model.description.world.scale, model.description.world.grip

    @abstractmethod
    def plan(self, view: View) -> list[ScriptPhase]:
        """Return what to do, from what is seen at the beginning."""

    def replan(self, view: View, name: str) -> list[ScriptPhase] | None:
        """Return what to do instead of what comes after the phase that ends; None to go on."""
        return None

    def reset(self, view: View) -> None:
        """Look at the scene and plan."""
        self._begin(self.plan(view), view.state.time)

    def _begin(self, phases: list[ScriptPhase], time: float) -> None:
        """Begin with the first of the phases that are left."""
        self._phases, self._entered = phases, time
        self._reached_at: float | None = None

    def motion_goal(self, view: View) -> steering.MotionGoal:
        """Return what is wanted now, and go to the next phase when this one is done."""
        self._advance(view)
        phase, hands = self._phases[0], range(len(self._model.description.hands))
        going, other = self._model.number ^ bool(phase.second), phase.other
        other = phase.gripper * bool(phase.apart) if other is None else other
        grippers = tuple(phase.gripper if hand == going else other for hand in hands)
        if self._reached_at is not None:
            return steering.MotionGoal.rest(phase.focus, grippers)
        hand = steering.hand_twist(phase.steered(view.task), phase.hand, self._gains, phase.pace)
        base = steering.base_twist(view.state.q, phase.base, self._gains)
        return steering.MotionGoal(hand, base, phase.focus, phase, grippers)

    def _advance(self, view: View) -> None:
        phase, time = self._phases[0], view.state.time
        patience = self._gains.patience * phase.patience
        if self._reached_at is None and (phase.is_reached(view) or time - self._entered > patience):
            self._reached_at = time
        if self._reached_at is None or time - self._reached_at < phase.dwell:
            return
        instead = self.replan(view, phase.name)
        following = self._phases[1:] if instead is None else instead
        if following:
            self._begin(following, time)
        else:
            self._phases = [replace(phase, dwell=np.inf)]


def from_phase(phases: list[ScriptPhase], name: str) -> list[ScriptPhase]:
    """Return the phases from the one of a name on."""
    return phases[[phase.name for phase in phases].index(name) :]


def turns(second: bool, other: float, phases: Iterable[ScriptPhase]) -> list[ScriptPhase]:
    """Return phases of one hand while the other holds still, its gripper closed or open."""
    return [replace(phase, second=second, other=other) for phase in phases]


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
        self._size = model.description.base.size
        self._clearance = _ROUTE_CLEARANCE * self._scale
        circles = ((item, np.hypot(*item.shape.size[:2]) / 2) for item in floor_obstacles(task.start.scene))
        self._circles = [(item.position[:2], radius) for item, radius in circles]
        behind = [place[0] - radius for place, radius in self._circles]
        self.lane = float(min(behind, default=0.0)) - self._size[0] / 2 - self._clearance

    def stand(self, place: FloatArray, edge: float) -> FloatArray:
        """Return where the base stands to work at a place, (3,): comfortable, and clear of the table.

        Args:
            place: what is worked at, (3,) [m].
            edge: the x of the table's near edge [m].
        """
        base = standing_point(self._model, place, comfort=_FROM_ABOVE)
        base[0] = min(base[0], edge - self._size[0] / 2 - self._clearance)
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
        width, way = np.hypot(*self._size) / 2 + self._clearance / 2, goal - start
        for place, radius in self._circles:
            along = np.clip((place - start) @ way / max(np.sum(way**2), 1e-9), 0, 1)
            if np.linalg.norm(place - start - along * way) < width + radius:
                return True
        return False

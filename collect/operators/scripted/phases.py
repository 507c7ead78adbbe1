"""A script made of phases: go there, with the hand or the base, then the next; routes among tables."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from handrail.collect.operators.modes import Focus
from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.placement import standing_point
from handrail.collect.operators.scripted.steering import (
    Gains,
    MotionGoal,
    Target,
    base_twist,
    hand_twist,
    pose_errors,
)
from handrail.collect.world.task import TaskState
from handrail.collect.world.tasks.furniture import floor_obstacles
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import Pose, RobotModel

_FROM_ABOVE = 0.7  # of the reach at home: comfortable where the hand points down
_ROUTE_CLEARANCE = 0.25  # of the chassis behind the floor obstacles, and before a table at scale 1 [m]


@dataclass(frozen=True)
class ScriptPhase(Target):
    """One thing to do: get the hand, or the base, to a target.

    Attributes:
        name: what it is, for whoever plans anew after it.
        focus: which of the two ends the phase, and is steered in switching mode.
        gripper: 0 open, 1 closed.
        beside: `distance` across the tool's axis, where more is good enough there [m].
        dwell: time to wait, hands still, before the next phase [s].
        patience: time after which the operator goes on anyway [s].
    """

    name: str = ""
    focus: Focus = "hand"
    gripper: float = 0.0
    beside: float = 0.0
    dwell: float = 0.0
    patience: float = np.inf


class PhasedScript(ABC):
    """Does one phase after the other; a script.

    Args:
        model: of the robot.
        gains: of the operator.
        drives: whether the operator drives the base by itself from place to place.
    """

    def __init__(self, model: RobotModel, gains: Gains, drives: bool) -> None:
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
        self._phases = phases
        self._enter(0, time)

    def motion_goal(self, view: View) -> MotionGoal:
        """Return what is wanted now, and go to the next phase when this one is done."""
        self._advance(view)
        phase = self._phases[min(self._index, len(self._phases) - 1)]
        if self._index >= len(self._phases) or self._reached_at is not None:
            return MotionGoal.rest(phase.focus, phase.gripper)
        hand = hand_twist(view.tool, phase.hand, self._gains, phase.pace)
        base = base_twist(view.state.q, phase.base, self._gains)
        return MotionGoal(hand, base, phase.focus, phase.gripper, phase)

    def _enter(self, index: int, time: float) -> None:
        self._index = index
        self._entered = time
        self._reached_at: float | None = None

    def _advance(self, view: View) -> None:
        if self._index >= len(self._phases):
            return
        phase, time = self._phases[self._index], view.state.time
        patience = self._gains.patience * phase.patience
        if self._reached_at is None and (_reached(phase, view) or time - self._entered > patience):
            self._reached_at = time
        if self._reached_at is not None and time - self._reached_at >= phase.dwell:
            instead = self.replan(view, phase.name)
            if instead is None:
                self._enter(self._index + 1, time)
            else:
                self._begin(instead, time)


def _reached(phase: ScriptPhase, view: View) -> bool:
    if phase.focus == "base":
        q = view.state.q
        turn = np.arctan2(np.sin(phase.base[2] - q[2]), np.cos(phase.base[2] - q[2]))
        return bool(np.hypot(*(phase.base[:2] - q[:2])) < phase.distance and abs(turn) < phase.angle)
    distance, angle = pose_errors(view.tool, phase.hand)
    if phase.beside:
        *across, along = view.tool.rotation.T @ (view.tool.position - phase.hand.position)
        distance = max(abs(along), np.hypot(*across) * phase.distance / phase.beside)
    return bool(distance < phase.distance and angle < phase.angle)


def from_phase(phases: list[ScriptPhase], name: str) -> list[ScriptPhase]:
    """Return the phases from the one of a name on."""
    return phases[next(index for index, phase in enumerate(phases) if phase.name == name) :]


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
        self._clearance = _ROUTE_CLEARANCE * self._scale
        self._obstacles = floor_obstacles(task.start.scene)
        behind = [item.position[0] - np.hypot(*item.shape.size[:2]) / 2 for item in self._obstacles]
        self.lane = float(min(behind, default=0.0)) - model.description.base.size[0] / 2 - self._clearance

    def stand(self, place: FloatArray, edge: float) -> FloatArray:
        """Return where the base stands to work at a place, (3,): comfortable, and clear of the table.

        Args:
            place: what is worked at, (3,) [m].
            edge: the x of the table's near edge [m].
        """
        base = standing_point(self._model, place, comfort=_FROM_ABOVE)
        length = self._model.description.base.size[0]
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
        width = np.hypot(*self._model.description.base.size) / 2 + self._clearance / 2
        for item in self._obstacles:
            along = np.clip(
                (item.position[:2] - start) @ (goal - start) / max(np.sum((goal - start) ** 2), 1e-9), 0, 1
            )
            gap = np.linalg.norm(item.position[:2] - start - along * (goal - start))
            if gap < width + np.hypot(*item.shape.size[:2]) / 2:
                return True
        return False

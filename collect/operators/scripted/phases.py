"""A script made of phases: go there, with the hand or the base, then the next."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from handrail.collect.operators.modes import Focus
from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.motion_goal import MotionGoal, Target
from handrail.collect.operators.scripted.steering import Gains, base_twist, hand_twist, pose_errors
from handrail.controllers.robot.model import RobotModel


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

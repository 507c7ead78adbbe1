"""A script made of phases: go there, with the hand or the base, then the next."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from handrail.collect.operators.human.motion_goal import MotionGoal, Target
from handrail.collect.operators.human.steering import Gains, base_twist, hand_twist, pose_errors
from handrail.collect.operators.modes import Focus
from handrail.collect.operators.operator import View
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import Pose


@dataclass(frozen=True)
class Phase:
    """One thing to do.

    Attributes:
        name: for logs and metrics.
        hand: goal of the tool.
        base: where the base would stand, (x, y, θ).
        focus: which of the two ends the phase, and is steered in switching mode.
        gripper: 0 open, 1 closed.
        distance: from the goal at which the phase ends [m].
        beside: the same across the tool's axis, where more is good enough there [m].
        angle: the same for orientation [rad].
        pace: share of the full stick.
        tilt: how far the hand may lean on the way [rad].
        dwell: time to wait, hands still, before the next phase [s].
        patience: time after which the operator goes on anyway [s].
    """

    name: str
    hand: Pose
    base: FloatArray
    focus: Focus = "hand"
    gripper: float = 0.0
    distance: float = 0.05
    beside: float = 0.0
    angle: float = 0.2
    pace: float = 1.0
    tilt: float = np.inf
    dwell: float = 0.0
    patience: float = np.inf


class PhaseRunner:
    """Runs phases one after the other; `redo` may send it back to an earlier one.

    Args:
        gains: of the operator.
        redo: asked when a phase ends; the index to go back to, or None to go on.
    """

    def __init__(self, gains: Gains, redo: Callable[[View, str], int | None]) -> None:
        self._gains = gains
        self._redo = redo

    def start(self, phases: list[Phase], time: float, index: int = 0) -> None:
        """Begin with a list of phases."""
        self._phases = phases
        self._enter(index, time)

    @property
    def phase(self) -> Phase:
        """The phase now."""
        return self._phases[min(self._index, len(self._phases) - 1)]

    def motion_goal(self, view: View) -> MotionGoal:
        """Return what is wanted now, and go to the next phase when this one is done."""
        self._advance(view)
        phase = self.phase
        if self._index >= len(self._phases) or self._reached_at is not None:
            return MotionGoal.rest(phase.focus, phase.gripper)
        hand = hand_twist(view.tool, phase.hand, self._gains, phase.pace)
        base = base_twist(view.state.q, phase.base, self._gains)
        target = Target(phase.hand, phase.base, phase.distance, phase.angle, phase.pace, phase.tilt)
        return MotionGoal(hand, base, phase.focus, phase.gripper, target)

    def _enter(self, index: int, time: float) -> None:
        self._index = index
        self._entered = time
        self._reached_at: float | None = None

    def _advance(self, view: View) -> None:
        if self._index >= len(self._phases):
            return
        time, patience = view.state.time, self._gains.patience * self.phase.patience
        if self._reached_at is None and (self._reached(view) or time - self._entered > patience):
            self._reached_at = time
        if self._reached_at is not None and time - self._reached_at >= self.phase.dwell:
            back = self._redo(view, self.phase.name)
            self._enter(self._index + 1 if back is None else back, time)

    def _reached(self, view: View) -> bool:
        phase = self.phase
        if phase.focus == "base":
            q = view.state.q
            turn = np.arctan2(np.sin(phase.base[2] - q[2]), np.cos(phase.base[2] - q[2]))
            return bool(np.hypot(*(phase.base[:2] - q[:2])) < phase.distance and abs(turn) < phase.angle)
        distance, angle = pose_errors(view.tool, phase.hand)
        if phase.beside:
            *across, along = view.tool.rotation.T @ (view.tool.position - phase.hand.position)
            distance = max(abs(along), np.hypot(*across) * phase.distance / phase.beside)
        return bool(distance < phase.distance and angle < phase.angle)

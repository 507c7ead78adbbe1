"""The scripted operator: a script that knows what it wants, seen and steered as a person would."""

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from handrail.collect.operators.modes import TeleopMode
from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.erring_axis import ErringAxisMap
from handrail.collect.operators.scripted.hand import HumanHand, Perception
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.input_map import InputMap, LeaderArmMap, StickMap
from handrail.collect.operators.scripted.single_axis import SingleAxisMap
from handrail.collect.operators.scripted.steering import Gains, MotionGoal, Target
from handrail.collect.world.tasks.catalogue import TaskSpec
from handrail.controllers.arrays import BoolArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.intent import Intent, RawInput
from handrail.controllers.registry import Registry, resolved
from handrail.controllers.robot.model import RobotModel

_POSITION_ORDER = 0.25 / 0.35  # refractory time of a position device over a velocity stick's


@dataclass(frozen=True)
class ScriptedDevice:
    """An operator's input device; the numbers are a scripted person's, tuned on the same seeds for each."""

    name: str  # as a mode names it
    help: str  # one line
    build: type[InputMap]  # its input map
    gains: Gains = field(default_factory=Gains)  # how briskly they steer
    drives: bool = False  # whether they drive the base by itself from place to place, whatever the mode
    refractory: float = 1.0  # their refractory time over that of a velocity stick


_BRISK = Gains(gain=1.8, hand_speed=0.7, joint_rate=1.2, patience=4.0)
_ERRS = "one stick, one axis at a time, with errors"
_LEADER = "a small copy of the arm, and a stick for the base"
DEVICES = Registry(
    "device",
    ScriptedDevice,
    (
        ScriptedDevice("sticks", "velocity sticks on all channels of a mode", StickMap),
        ScriptedDevice("single_axis", "one stick, one axis at a time", SingleAxisMap, _BRISK, drives=True),
        ScriptedDevice("single_axis_erring", _ERRS, ErringAxisMap, _BRISK, drives=True),
        ScriptedDevice("leader_arm", _LEADER, LeaderArmMap, refractory=_POSITION_ORDER),
    ),
)


class Script(Protocol):
    """The steps of a task, moment by moment."""

    def reset(self, view: View) -> None:
        """Look at the scene and make up the mind."""

    def motion_goal(self, view: View) -> MotionGoal:
        """Return what is wanted now."""
        ...


class ScriptedOperator:
    """Follows a script in a teleop mode; an operator.

    ```
    script ─ goal ─▶ perception ─▶ input map ─ wanted ─▶ hand ─▶ input map ─ sent ─▶ intent
                     (misjudges)   (of the mode)         (late, intermittent, noisy)
    ```
    Only the input map differs between modes.

    Args:
        model: of the robot.
        script: of the task.
        mode: the teleop mode.
        human: who steers.
        gains: how briskly they steer.

    Attributes:
        free_at: when the hand is back on the input after the last change of channels [s]; −∞ before any.
        target: where the goal of the last intent leads; None to rest.
    """

    def __init__(
        self, model: RobotModel, script: Script, mode: TeleopMode, human: HumanSettings, gains: Gains
    ) -> None:
        self._script, self._mode = script, mode
        device = DEVICES.find(mode.device)
        self._map = device.build(model, mode, gains)
        self._human = replace(human, refractory=human.refractory * device.refractory)

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode; how the person is today is drawn first."""
        self._settings = self._human.episode(rng)
        self._script.reset(view)
        self._perception = Perception(self._settings, rng)
        self._hand = HumanHand(self._settings, self._map.full, self._map.fine, rng)
        self._map.reset(view, self._settings, rng)
        self.target: Target | None = None
        self._mask: BoolArray | None = None
        self._switches = 0
        self.free_at = -np.inf

    def act(self, view: View) -> Intent:
        """Return the intent now: the goal in this mode's channels, as the hand manages it."""
        time = view.state.time
        goal = self._script.motion_goal(view)
        self.target = goal.target
        tool = goal.target.steered(view.task) if goal.target else view.tool
        goal = self._perception.see(goal, tool, time, view.task.tools[-1 - view.task.hand])
        mask, wanted = self._map.wanted(goal, view.state)
        self._switch(mask, time)
        moved = self._hand.move(np.zeros_like(wanted) if time < self.free_at else wanted, time)
        moved = np.where(mask, moved, 0.0)
        values = np.where(mask, self._map.sent(moved, view.state), 0.0)
        raw = RawInput(self._map.raw(moved), int(np.count_nonzero(moved)), self._switches)
        grippers = goal.grippers or (0.0,) * len(self._map.channels.hands)
        return Intent(values, mask, grippers, self._mode.name, time, raw=raw)

    def _switch(self, mask: BoolArray, time: float) -> None:
        """Take the hand off the input for a moment when it acts on other channels from now on."""
        if self._mask is not None and mask is not self._mask and (mask != self._mask).any():
            self._switches += 1
            self.free_at = time + self._settings.switch_time
        self._mask = mask


def scripted_operator(
    model: RobotModel, mode: TeleopMode, task: TaskSpec, human: HumanSettings
) -> ScriptedOperator:
    """Return who does a task's script in a mode, as brisk as people are with its device."""
    if refused := task.refuses(mode.groups("hand")):
        raise HandrailError(f"mode {mode.name}: the script of task {task.name} expected {refused}")
    gains = gains_of(model, mode, human)
    drives = DEVICES.find(mode.device).drives or mode.by_focus
    script = resolved(task.script)(model, gains, drives=drives)
    return ScriptedOperator(model, script, mode, human, gains)


def gains_of(model: RobotModel, mode: TeleopMode, human: HumanSettings) -> Gains:
    """Return how briskly a person steers a robot with a mode's device."""
    gains = DEVICES.find(mode.device).gains.within(model.description.world)
    return replace(gains, gain=human.briskness * gains.gain)

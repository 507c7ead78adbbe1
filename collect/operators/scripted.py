"""The scripted operator: a script that knows what it wants, through a human-like hand."""

from typing import Protocol

import numpy as np

from handrail.collect.operators.human import HumanHand, HumanSettings
from handrail.collect.operators.modes import Focus, InputMap, TeleopMode, Wish
from handrail.collect.operators.operator import View
from handrail.collect.operators.steering import Gains
from handrail.controllers.intent import Intent
from handrail.controllers.model import RobotModel


class Script(Protocol):
    """What to do for a task, moment by moment."""

    def reset(self, view: View) -> None:
        """Look at the scene and make up the mind."""
        ...

    def wish(self, view: View) -> Wish:
        """Return what is wanted now."""
        ...


class ScriptedOperator:
    """Follows a script in a teleop mode; an operator.

    Args:
        model: of the robot.
        script: of the task.
        mode: the teleop mode.
        human: how human the hand is.
        gains: how briskly it steers.
    """

    def __init__(
        self,
        model: RobotModel,
        script: Script,
        mode: TeleopMode,
        human: HumanSettings,
        gains: Gains,
    ) -> None:
        self._script = script
        self._map = InputMap(model, mode, gains)
        self._settings = human
        self._hand = HumanHand(human, self._map.full)

    @property
    def name(self) -> str:
        """What the dataset says of who steered."""
        return "scripted"

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""
        self._script.reset(view)
        self._hand.reset(rng)
        self._focus: Focus | None = None
        self._free_at = -np.inf

    def act(self, view: View) -> Intent:
        """Return the intent now: the wish in this mode's channels, as the hand manages it."""
        wish = self._script.wish(view)
        time = view.state.time
        self._switch(wish.focus, time)
        wanted = self._map.values(wish, view.state.q)
        if time < self._free_at:
            wanted = np.zeros_like(wanted)
        mask = self._map.mask(wish.focus)
        values = np.where(mask, self._hand.move(wanted, time), 0.0)
        return Intent(values, mask, wish.gripper, self._map.mode.name, time)

    def _switch(self, focus: Focus, time: float) -> None:
        """Take the hand off the stick for a moment when the mode's channels change."""
        changes = self._focus is not None and self._map.mode.groups(focus) != self._map.mode.groups(
            self._focus
        )
        if changes:
            self._free_at = time + self._settings.switch_time
        self._focus = focus

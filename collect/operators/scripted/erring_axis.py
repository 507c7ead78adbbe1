"""One axis at a time by somebody who errs: looks for the axis, takes a wrong one, pushes it the wrong way."""

import math

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.single_axis import PREPARATION, SingleAxisMap
from handrail.collect.operators.scripted.steering import MotionGoal, Target
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.interface.controller import State

_A_BIT = 0.15  # to choose among n, for each bit log₂(n + 1): Card, Moran and Newell 1983, 0 to 0.157 [s]
_WRONG_AXIS = 0.003  # probability of a wrong one of similar controls: Swain, Guttmann 1983, table 20-12 (2)
_WRONG_WAY = 0.05  # of turning a control against what one expects: there (6)
_GUESS = 0.5  # the same under stress, a guess: there (7); here of a joint's first push in an episode


class ErringAxisMap(SingleAxisMap):
    """As `SingleAxisMap`, by somebody who loses their way among the joints.

    To change the axis takes `0.15 log₂(n + 1)` s among n. With some probability it is another joint, or it is
    pushed the wrong way. They notice when it has gone as far as is near enough, or as the way to go is
    misjudged; then they let go, think, and do what they meant. Nobody has measured whether people err so with
    a robot's joints: the numbers are of control panels.
    """

    def reset(self, view: View, settings: HumanSettings, rng: np.random.Generator) -> None:
        """Begin with no joint known."""
        super().reset(view, settings, rng)
        self._rng, self._misjudged = rng, settings.misjudgement
        self._known: set[int] = set()
        self._last: int | None = None
        self._astray: tuple[int, float, FloatArray, float] | None = None  # joint, sign, q, how far unnoticed
        self._rests = -math.inf  # until when the hand rests [s]

    def wanted(self, goal: MotionGoal, state: State) -> tuple[BoolArray, FloatArray]:
        """Return the mask of the axis that the hand is on, and how far the stick shall be pushed."""
        mask, values = super().wanted(goal, state)
        axis = self._axis if values.any() else None
        if axis is not None and axis != self._last:
            self._last, self._rests = axis, state.time + _A_BIT * math.log2(1 + len(self._axes))
            self._astray = self._error(axis, state.q) if axis >= self._arm.start else None
        if self._astray:
            shown, sign, since, unnoticed = self._astray
            moved = state.q - since
            mask = np.arange(self.channels.size) == shown
            values = np.where(mask, sign * float(np.abs(values).max()), 0.0)
            if abs(moved[self._coordinate(shown)]) > unnoticed:
                self._astray, self._rests = None, state.time + PREPARATION
        return mask, values if state.time >= self._rests else np.zeros_like(values)

    @property
    def _axes(self) -> list[int]:
        """All axes of the base and the arm."""
        return [*range(self._base), *range(self._arm.start, self._arm.stop)]

    def _error(self, axis: int, q: FloatArray) -> tuple[int, float, FloatArray, float] | None:
        """Return what goes wrong with a joint that is newly chosen, if anything."""
        others = [each for each in self._axes if each >= self._arm.start and each != axis]
        other = int(self._rng.choice(others))
        wrong = self._rng.random(2) < (_WRONG_AXIS, _WRONG_WAY if axis in self._known else _GUESS)
        self._known.add(axis)
        unnoticed = max(self._tolerance, self._misjudged * abs(self._way))
        sign = float(np.sign(self._way)) * (-1.0 if wrong[1] else 1.0)
        return (other if wrong[0] else axis, sign, q.copy(), unnoticed) if wrong.any() else None

    def _choose(
        self, target: Target, errors: FloatArray, tolerances: FloatArray, q: FloatArray
    ) -> int | None:
        """Return the axis that is meant; remember its way and how near is near enough."""
        axis = super()._choose(target, errors, tolerances, q)
        if axis is not None:
            self._way, self._tolerance = errors[axis], tolerances[axis]
        return axis

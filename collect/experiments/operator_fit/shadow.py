"""What a scripted operator would do, seeing what a person saw; the robot does not listen to them."""

from dataclasses import replace

import numpy as np

from handrail.collect.experiments.operator_fit.episodes import Steered
from handrail.collect.experiments.operator_fit.statistics import sums
from handrail.collect.operators.human.human import HumanSettings
from handrail.collect.operators.human.motion_goal import MotionGoal
from handrail.collect.operators.human.steering import Gains, base_twist, hand_errors, steered
from handrail.collect.operators.operator import View
from handrail.collect.operators.scripts.scripted import ScriptedOperator
from handrail.controllers.arrays import BoolArray, FloatArray

_PATIENCE = 2.0  # for how long a scripted operator may do nothing at first [s, times their delay]
_PRESSED = 0.5  # of full stick, from which on who has keys presses one


class Shadow:
    """An episode, shadowed by scripted operators.

    Args:
        episode: what a person saw and did.

    Attributes:
        episode: the same.
        wanted: what an operator without any weakness would do, at once, (T, m).
    """

    def __init__(self, episode: Steered) -> None:
        self.episode = episode
        self._errors = [
            hand_errors(view.tool, goal.target.hand) if goal.target else np.zeros(6)
            for view, goal in zip(episode.views, episode.goals, strict=True)
        ]
        self.wanted, _ = self._steer(HumanSettings.perfect(), np.random.default_rng(0))

    def recorded(self) -> FloatArray:
        """Return the sums of what the person did, (2, s)."""
        return sums(self.episode.inputs, self.wanted, self.episode.owned, self.episode.fps)

    def simulated(self, human: HumanSettings, rng: np.random.Generator) -> FloatArray:
        """Return the sums of what a scripted operator would do, (2, s)."""
        inputs, owned = self.inputs(human, rng)
        return sums(inputs, self.wanted, owned, self.episode.fps)

    def inputs(self, human: HumanSettings, rng: np.random.Generator) -> tuple[FloatArray, BoolArray]:
        """Return how far a scripted operator pushes each channel, over full stick, and which are theirs.

        (T, m) each. The first frame is the one in which they first push anything, as it is in the episode.
        """
        moved, owned = self._steer(human, rng)
        if self.episode.keys:
            moved = np.where(np.abs(moved) >= _PRESSED, np.sign(moved), 0.0)
        return moved, owned

    def _steer(self, human: HumanSettings, rng: np.random.Generator) -> tuple[FloatArray, BoolArray]:
        episode, period = self.episode, 1.0 / self.episode.fps
        gains = replace(episode.gains, gain=human.briskness * episode.gains.gain)
        script = _Recalled(self._goals(gains))
        operator = ScriptedOperator(episode.model, script, episode.mode, human, gains)
        first, *later = episode.views
        operator.reset(first, rng)
        intents = []
        for frame in range(1 + round((_PATIENCE * human.delay + _PATIENCE) * episode.fps)):
            script.wait()
            intents = [operator.act(_at(first, frame * period))]
            if intents[0].raw.values.any():
                break
        intents += [operator.act(_at(view, (frame + place) * period)) for place, view in enumerate(later, 1)]
        owned = np.array([intent.mask for intent in intents])
        return np.where(owned, [intent.raw.values for intent in intents], 0.0), owned

    def _goals(self, gains: Gains) -> list[MotionGoal]:
        """Return what the script wants, at other gains than it was asked with."""
        return [
            _with(goal, errors, view, gains)
            for goal, errors, view in zip(self.episode.goals, self._errors, self.episode.views, strict=True)
        ]


class _Recalled:
    """Wants what was wanted, one after the other; a script."""

    def __init__(self, goals: list[MotionGoal]) -> None:
        self._goals = goals

    def reset(self, view: View) -> None:
        """Begin."""
        self._next = 0

    def wait(self) -> None:
        """Stay at the first."""
        self._next = 0

    def motion_goal(self, view: View) -> MotionGoal:
        """Return the next."""
        goal = self._goals[self._next]
        self._next += 1
        return goal


def _with(goal: MotionGoal, errors: FloatArray, view: View, gains: Gains) -> MotionGoal:
    if goal.target is None:
        return goal
    base = base_twist(view.state.q, goal.target.base, gains)
    return replace(goal, hand=steered(errors, gains, goal.target.pace), base=base)


def _at(view: View, seconds: float) -> View:
    return replace(view, state=replace(view.state, time=seconds))

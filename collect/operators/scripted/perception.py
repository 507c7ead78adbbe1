"""Perception: people misjudge how far it is, more the farther it is; nothing else is imagined wrongly."""

from dataclasses import replace

import numpy as np

from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.motion_goal import MotionGoal
from handrail.collect.operators.scripted.steering import hand_errors
from handrail.collect.operators.scripted.wander import Wander
from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import matrix_from_vector
from handrail.controllers.robot.model import Pose


class Perception:
    """Adds `σ ‖x‖ a` to each distance to go x, where a is an Ornstein–Uhlenbeck process (Weber's law).

    x is the way of the hand, its turn, the way of the base, its turn. It is the same in every teleop mode:
    what is misjudged is the task, not the input. An operator who thinks of joints thinks of those that would
    put the hand where it seems to belong: the error at the hand is that of who steers the hand.

    Args:
        settings: of the person.
        rng: of the episode.
    """

    def __init__(self, settings: HumanSettings, rng: np.random.Generator) -> None:
        self._share = settings.misjudgement
        self._wander = Wander((9,), settings.correlation, rng)

    def see(self, goal: MotionGoal, tool: Pose, time: float) -> MotionGoal:
        """Return the goal as it comes out of what is seen at a time [s]."""
        wander = self._share * self._wander.at(time)
        if not self._share:
            return goal
        hand = np.concatenate([_off(goal.hand[:3], wander[:3]), _off(goal.hand[3:], wander[3:6])])
        base = np.concatenate([_off(goal.base[:2], wander[6:8]), _off(goal.base[2:], wander[8:])])
        target = goal.target
        if target is not None:
            errors = hand_errors(tool, target.hand)
            away, turn = _off(errors[:3], wander[:3]), _off(errors[3:], wander[3:6])
            seen = Pose(tool.position + away, matrix_from_vector(turn) @ tool.rotation)
            target = replace(target, hand=seen, meant=target.hand)
        return replace(goal, hand=hand, base=base, target=target)


def _off(vector: FloatArray, share: FloatArray) -> FloatArray:
    return vector + np.linalg.norm(vector) * share

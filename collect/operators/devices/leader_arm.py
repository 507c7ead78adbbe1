"""A leader arm: the operator moves a small copy of the arm; the robot's joints go where its joints are."""

import numpy as np

from handrail.collect.operators.devices.input_map import InputMap
from handrail.collect.operators.devices.large_turn import LargeTurn
from handrail.collect.operators.human.human import HumanSettings
from handrail.collect.operators.human.motion_goal import MotionGoal
from handrail.collect.operators.human.wander import Wander
from handrail.collect.operators.operator import View
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.baselines.arm_completion import ArmCompletion
from handrail.controllers.interface.controller import State

_LARGE = (
    0.6  # turn of the hand from which on the operator brings the leader's joints there, not its hand [rad]
)
_FOLLOW = 6.0  # of the joints towards the leader's [1/s]


class LeaderArmMap(InputMap):
    """Absolute joint targets from one hand, a stick for the base in the other; nothing to switch.

    The hand takes the leader along, whose joints q_L follow by its mechanics: `q̇_L = J⁺ hand`. A large turn
    would fold the arm on the way; there the operator brings all joints at once to where these seem to belong
    (`LargeTurn`). The robot is sent `q̇ = q̇_L + k (q_L + tremor − q)`. The leader starts where the arm is, so
    that nothing jumps.
    """

    def reset(self, view: View, settings: HumanSettings, rng: np.random.Generator) -> None:
        """Take hold of the leader, which stands as the arm does."""
        size = self._model.size - self._base
        self._mechanics = ArmCompletion(self._model)
        self._turn = LargeTurn(self._model, self._gains, _LARGE, view, settings.misjudgement, rng)
        self._leader = view.state.q[self._base :].copy()
        self._tremor = settings.tremor
        self._wander = Wander((size,), settings.correlation, rng)
        self._still = self._wander.at(view.state.time).copy()  # the tremor counts from how the hand took hold
        self._time = view.state.time

    def wanted(self, goal: MotionGoal, state: State) -> tuple[BoolArray, FloatArray]:
        """Return the mask, base stick and arm together, and how fast the leader shall be moved."""
        values = np.zeros(self.channels.size)
        if goal.focus == "base":
            values[self.channels.base_slice] = goal.base[: self._base]
        else:
            values[self._arm] = self._taken_along(goal, state.q)
        return self.channels.mask(*(("base",) if self._base else ()), "arm"), values

    def sent(self, moved: FloatArray, state: State) -> FloatArray:
        """Return the base's stick, and the velocity that takes the arm's joints to the leader's."""
        elapsed, self._time = state.time - self._time, state.time
        lower, upper = self._limits()
        self._leader = np.clip(self._leader + elapsed * moved[self._arm], lower, upper)
        trembling = self._tremor * (self._wander.at(state.time) - self._still)
        sent = moved.copy()
        sent[self._arm] += _FOLLOW * (self._leader + trembling - state.q[self._base :])
        return sent

    def raw(self, moved: FloatArray) -> FloatArray:
        """Return the base's deflection and the leader's joint angles [rad]."""
        raw = moved / self.full
        raw[self._arm] = self._leader
        return raw

    def _taken_along(self, goal: MotionGoal, q: FloatArray) -> FloatArray:
        """Return how fast the operator moves the leader's joints, (n − b,) [rad/s]."""
        if goal.target is not None and self._turn.is_ahead(goal.target, q):
            return self._turn.arm_velocity(goal.target, q, q[: self._base])
        return self._mechanics.arm_velocity(q, np.zeros(self._base), goal.hand)

    def _limits(self) -> tuple[FloatArray, FloatArray]:
        limits = self._model.description.limits
        return limits.position_lower[self._base :], limits.position_upper[self._base :]

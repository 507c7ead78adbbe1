"""A leader arm: the operator moves a small copy of the arm; the robot's joints go where its joints are."""

import numpy as np

from handrail.collect.operators.devices.input_map import StickMap
from handrail.collect.operators.human.human import HumanSettings
from handrail.collect.operators.human.motion_goal import MotionGoal
from handrail.collect.operators.human.steering import FOLLOW
from handrail.collect.operators.operator import View
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.interface.controller import State
from handrail.controllers.numerics.rotation import turned


class LeaderArmMap(StickMap):
    """Absolute joint targets from one hand, a stick for the base in the other, both at once; no switching.

    How fast base and arm shall move is what an expert on velocity sticks finds (`StickMap`). The leader's
    joints q_L are taken along so fast, and the robot is sent `q̇ = q̇_L + k (q_L − q)`. The leader starts
    where the arm is, so that nothing jumps.
    """

    def reset(self, view: View, settings: HumanSettings, rng: np.random.Generator) -> None:
        """Take hold of the leader, which stands as the arm does."""
        super().reset(view, settings, rng)
        self._leader = view.state.q[self._base :].copy()
        self._time = view.state.time

    def wanted(self, goal: MotionGoal, state: State) -> tuple[BoolArray, FloatArray]:
        """Return the mask, base stick and arm together, and how fast the leader shall be moved."""
        velocity, values = self._joint_velocities(goal, state.q), np.zeros(self.channels.size)
        if self._base:
            values[self.channels.base_slice] = turned(velocity[: self._base], -state.q[2])
        values[self._arm] = velocity[self._base :]
        return self.mask(goal.focus), np.clip(values, -self.full, self.full)

    def sent(self, moved: FloatArray, state: State) -> FloatArray:
        """Return the base's stick, and the velocity that takes the arm's joints to the leader's."""
        elapsed, self._time = state.time - self._time, state.time
        lower, upper = self._limits()
        self._leader = np.clip(self._leader + elapsed * moved[self._arm], lower, upper)
        sent = moved.copy()
        sent[self._arm] += FOLLOW * (self._leader - state.q[self._base :])
        return sent

    def raw(self, moved: FloatArray) -> FloatArray:
        """Return the base's deflection and the leader's joint angles [rad]."""
        raw = moved / self.full
        raw[self._arm] = self._leader
        return raw

    def _limits(self) -> tuple[FloatArray, FloatArray]:
        limits = self._model.description.limits
        return limits.position_lower[self._base :], limits.position_upper[self._base :]

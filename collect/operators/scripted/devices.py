"""The devices by name: what an operator has in hand, and how a scripted person steers with it."""

from dataclasses import dataclass, field

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.input_map import InputMap, StickMap
from handrail.collect.operators.scripted.motion_goal import MotionGoal
from handrail.collect.operators.scripted.single_axis import SingleAxisMap
from handrail.collect.operators.scripted.steering import FOLLOW, Gains
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.interface.controller import State
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.registry import Registry

_POSITION_ORDER = 0.25 / 0.35  # refractory time of a position device over a velocity stick's


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


@dataclass(frozen=True)
class ScriptedDevice:
    """What an operator has in hand; the numbers are a scripted person's, tuned on the same seeds for each.

    Attributes:
        name: as a mode names it.
        help: one line.
        build: its input map.
        gains: how briskly they steer.
        drives: whether they drive the base by itself from place to place, whatever the mode.
        refractory: their refractory time over that of a velocity stick.
    """

    name: str
    help: str
    build: type[InputMap]
    gains: Gains = field(default_factory=Gains)
    drives: bool = False
    refractory: float = 1.0


DEVICES = Registry(
    "device",
    ScriptedDevice,
    (
        ScriptedDevice("sticks", "velocity sticks on all channels of a mode", StickMap),
        ScriptedDevice(
            "single_axis",
            "one stick, one axis at a time",
            SingleAxisMap,
            Gains(gain=1.8, hand_speed=0.7, joint_rate=1.2, patience=4.0),
            drives=True,
        ),
        ScriptedDevice(
            "leader_arm",
            "a small copy of the arm, and a stick for the base",
            LeaderArmMap,
            refractory=_POSITION_ORDER,
        ),
    ),
)

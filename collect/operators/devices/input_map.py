"""Input maps: how a goal becomes values on the channels of a mode; nothing else differs between modes."""

from abc import ABC, abstractmethod

import numpy as np

from handrail.collect.operators.devices.large_turn import LargeTurn
from handrail.collect.operators.human.human import HumanSettings
from handrail.collect.operators.human.motion_goal import MotionGoal
from handrail.collect.operators.human.steering import Gains
from handrail.collect.operators.modes import Focus, TeleopMode
from handrail.collect.operators.operator import View
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import RobotModel

_DAMPING = 0.006  # beside the hand's weight of 1, like the two below: larger ones hold it off its goal
_BASE_WEIGHT = 0.03
_POSTURE = 0.02  # weight of the arm's posture at home, so that it does not fold the wrong way
_LARGE = 2.0  # turn of the hand from which on the expert thinks of where the arm's joints belong [rad]
_RETURN = 0.5  # how fast it would go back there [1/s]


class InputMap(ABC):
    """What lies between a goal and an intent: what the operator has in hand.

    Args:
        model: of the robot.
        mode: the teleop mode.
        gains: full stick of hand and base.

    Attributes:
        channels: of the robot.
        full: full deflection of every input, (m,) [m/s, rad/s].
        fine: what the hand's dead zone and drift are shares of, (m,): full deflection, of all joints together
            made to the measure of the stick for the hand (`as_fine`).
    """

    def __init__(self, model: RobotModel, mode: TeleopMode, gains: Gains) -> None:
        self.mode = mode
        self.channels = Channels.of(model.description)
        self._model, self._gains = model, gains
        self._base = len(self.channels.base)
        self._arm = slice(self.channels.joint_slice.start + self._base, self.channels.size)
        base, joints = gains.full[6:][: self._base], np.full(model.size, gains.joint_rate)
        joints[: self._base] = base
        self.full: FloatArray = np.concatenate([base, gains.full[:6], joints])
        finely = as_fine(model, joints, gains.full[:6]) * joints
        self.fine: FloatArray = np.concatenate([base, gains.full[:6], finely])

    @abstractmethod
    def reset(self, view: View, settings: HumanSettings, rng: np.random.Generator) -> None:
        """Begin an episode with a person."""

    @abstractmethod
    def wanted(self, goal: MotionGoal, state: State) -> tuple[BoolArray, FloatArray]:
        """Return the channels that the operator owns now, (m,), and how far they want each input, (m,)."""

    def sent(self, moved: FloatArray, state: State) -> FloatArray:
        """Return what the device makes of where the inputs are, (m,): of sticks, the velocities they mean."""
        return moved

    def raw(self, moved: FloatArray) -> FloatArray:
        """Return what the device reads, (m,): deflections from −1 to 1."""
        return moved / self.full


class StickMap(InputMap):
    """Velocity sticks on all channels of a mode at once.

    Where the mode has joint channels, the operator solves for them, as an expert would, who sees the goal no
    better than who steers the hand, but knows the arm:
    `min ‖J v - hand‖² + w_b ‖v_base - base‖² + w_p ‖v_arm - k (q_home - q)‖² + λ ‖v / v_max‖²`.
    A large turn would fold the arm into itself that way; there they bring the arm's joints straight to where
    these belong (`LargeTurn`), while the base drives.
    """

    def reset(self, view: View, settings: HumanSettings, rng: np.random.Generator) -> None:
        """Begin with nothing thought of."""
        if self.mask("hand")[self.channels.joint_slice].any():
            self._turn = LargeTurn(self._model, self._gains, _LARGE, view)

    def mask(self, focus: Focus) -> BoolArray:
        """Return the channels that the operator owns, (m,)."""
        return self.channels.mask(*self.mode.groups(focus))

    def wanted(self, goal: MotionGoal, state: State) -> tuple[BoolArray, FloatArray]:
        """Return the mask, and the goal on every channel of the mode, within full stick, (m,)."""
        mask = self.mask(goal.focus)
        values = np.zeros(self.channels.size)
        values[self.channels.base_slice] = goal.base[: self._base]
        values[self.channels.tool_slice] = goal.hand
        if mask[self.channels.joint_slice].any():
            values[self.channels.joint_slice] = self._joint_velocities(goal, state.q)
        return mask, np.clip(np.where(mask, values, 0.0), -self.full, self.full)

    def _joint_velocities(self, goal: MotionGoal, q: FloatArray) -> FloatArray:
        """Return what the expert makes of a goal on all joints, (n,), within full stick."""
        if goal.target is not None and self._turn.is_ahead(goal.target, q):
            arm = self._turn.arm_velocity(goal.target, q, goal.target.base[: self._base])
            return np.concatenate([self._base_world(goal, q), arm])
        return self._inner_kinematics(goal, q)

    def _inner_kinematics(self, goal: MotionGoal, q: FloatArray) -> FloatArray:
        """Return the expert's inner inverse kinematics, (n,): the hand first, the base when it can."""
        jacobian = self._model.jacobian(q)
        base = self._base_world(goal, q)
        weights = np.full(self._model.size, _DAMPING) / self._model.description.limits.velocity
        home = self._model.description.home - q
        home[: self._base] = 0.0
        posture = _POSTURE * np.any(goal.hand) * np.eye(self._model.size)[self._base :]
        rows = [jacobian, np.diag(weights), posture]
        targets = [goal.hand, np.zeros(self._model.size), posture @ (_RETURN * home)]
        if len(base):
            rows.append(_BASE_WEIGHT * np.eye(len(base), self._model.size))
            targets.append(_BASE_WEIGHT * base)
        solution: FloatArray = np.linalg.lstsq(np.vstack(rows), np.concatenate(targets), rcond=None)[0]
        return solution / max(1.0, float(np.max(np.abs(solution) / self.full[self.channels.joint_slice])))

    def _base_world(self, goal: MotionGoal, q: FloatArray) -> FloatArray:
        return turned(goal.base, q[2]) if self.channels.base else np.zeros(0)


def as_fine(model: RobotModel, joints: FloatArray, hand: FloatArray) -> float:
    """Return the share of full stick on all joints that moves the tool at home as 1 of the hand's stick does.

    `1 / √(mean_i Σ_j (J_ij joints_j / hand_i)²)`. So a person is as exact at the tool with joints as with the
    hand; else 2 % of every joint's stick shake it 2.5 times as much as 2 % of the hand's, and inside a dead
    zone of 3 % each it may stay 3 cm from where it shall be.

    Args:
        model: of the robot.
        joints: full stick of each joint, (n,).
        hand: full stick of the hand, (6,).
    """
    moved = model.jacobian(model.description.home) * joints / hand[:, None]
    return float(1.0 / np.sqrt(np.mean(np.sum(moved**2, axis=1))))

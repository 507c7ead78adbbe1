"""Input maps: how a goal becomes values on the channels of a mode; nothing else differs between modes."""

from abc import ABC, abstractmethod

import numpy as np

from handrail.collect.operators.modes import Focus, TeleopMode
from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted import steering
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.placement import straight_solution
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.inverse_kinematics import arm_configuration
from handrail.controllers.robot.model import RobotModel

_DAMPING = 0.006  # beside the hand's weight of 1, like the two below: larger ones hold it off its goal
_BASE_WEIGHT = 0.03
_POSTURE = 0.02  # weight of the arm's posture at home, so that it does not fold the wrong way
_LARGE = 2.0  # turn of the hand from which on the expert thinks of where the arm's joints belong [rad]
_RETURN = 0.5  # how fast it would go back there [1/s]
_CLEAR = 0.03  # what the motion shall keep clear [m]
_EXACTLY = 1e-3  # how well one knows where joints belong [m, rad]


class LargeTurn:
    """Turns the hand by joints, where following the hand would fold the arm into itself.

    `q̇ = s k_h (q_ik − q)`, with s such that neither hand nor joints move faster than at full stick. Which of
    the inverse kinematics' solutions it is, is thought of once a target: the nearest that is clear. Where
    it is follows the pose as the operator sees it from moment to moment.

    Args:
        model: of the robot.
        gains: full stick of hand and joints.
        view: of the scene, at the beginning of an episode.
    """

    def __init__(self, model: RobotModel, gains: steering.Gains, view: View) -> None:
        self._model, self._gains = model, gains
        self._base = len(model.description.base.joints)
        self._collision = CollisionModel(model, view.task.obstacles)
        self._goal = view.state.q.copy()
        self._thought = b""

    def is_ahead(self, target: steering.Target, q: FloatArray) -> bool:
        """Return whether the hand has to turn far to where a goal leads."""
        return float(np.linalg.norm(steering.hand_errors(self._model.pose(q), target.hand)[3:])) > _LARGE

    def arm_velocity(self, target: steering.Target, q: FloatArray, base: FloatArray) -> FloatArray:
        """Return the velocity straight to where the arm's joints belong, (n − b,) [rad/s].

        Args:
            target: where the goal leads, as it is seen.
            q: joint positions, (n,).
            base: of the base, from where the operator thinks the hand reaches the target, (b,).
        """
        anew, gains = target.identity != self._thought, self._gains
        start = np.concatenate([base, (q if anew else self._goal)[self._base :]])
        if anew:
            self._goal = straight_solution(self._model, self._collision, start, target.hand, _CLEAR)
            self._thought = target.identity
        else:
            self._goal = arm_configuration(self._model, start, target.hand, _EXACTLY)[0]
        velocity = gains.gain * (self._goal - q)[self._base :]
        hand = self._model.jacobian(q)[:, self._base :] @ velocity
        fastest = target.pace * gains.full[[0, 3]]  # of the hand, and how fast it may turn
        excess = np.array([np.linalg.norm(hand[:3]), np.linalg.norm(hand[3:])]) / fastest
        of_joints = float(np.max(np.abs(velocity)) / gains.joint_rate)
        return velocity / max(1.0, float(np.max(excess)), of_joints)


class InputMap(ABC):
    """The map from a goal to an intent: the operator's input device.

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

    def __init__(self, model: RobotModel, mode: TeleopMode, gains: steering.Gains) -> None:
        self.mode = mode
        self._masks: dict[Focus, BoolArray] = {}
        self.channels = Channels.of(model.description)
        self._model, self._gains = model, gains
        self._base = len(self.channels.base)
        self._arm = slice(self.channels.joint_slice.start + self._base, self.channels.size)
        moved = np.sum([self.channels.moving(hand) for hand in range(len(self.channels.hands))], axis=0)
        self._used = (moved < 2) | (np.arange(model.size) < self._base)  # a torso is slow: it is left alone
        self.full, joints = steering.full_stick(self.channels, gains), self.channels.joint_slice
        self.fine = self.full.copy()
        self.fine[joints] *= as_fine(model, self.full[joints], gains.full[:6])

    @abstractmethod
    def reset(self, view: View, settings: HumanSettings, rng: np.random.Generator) -> None:
        """Begin an episode with a person."""

    @abstractmethod
    def wanted(self, goal: steering.MotionGoal, state: State) -> tuple[BoolArray, FloatArray]:
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
            self._turn = LargeTurn(self._model, self._gains, view)

    def mask(self, focus: Focus) -> BoolArray:
        """Return the channels that the operator owns, (m,)."""
        if focus not in self._masks:
            self._masks[focus] = self.channels.mask(*self.mode.owned(focus, self._model.hand.name))
        return self._masks[focus]

    def wanted(self, goal: steering.MotionGoal, state: State) -> tuple[BoolArray, FloatArray]:
        """Return the mask, and the goal on every channel of the mode, within full stick, (m,)."""
        mask = self.mask(goal.focus)
        values = np.zeros(self.channels.size)
        values[self.channels.base_slice] = goal.base[: self._base]
        for hand, twist in self._twists(goal, state.q).items():
            values[self.channels.hand_slice(hand)] = twist
        if self.channels.pair:  # whoever steers both moves them as they would move the one
            values[self.channels.pair_slice][:6] = goal.hand
        if mask[self.channels.joint_slice].any():
            values[self.channels.joint_slice] = self._joint_velocities(goal, state.q)
        return mask, np.minimum(np.maximum(np.where(mask, values, 0.0), -self.full), self.full)

    def _twists(self, goal: steering.MotionGoal, q: FloatArray) -> dict[int, FloatArray]:
        """Return what is wanted of hands, by number: of each of a pair what brings it to its own place."""
        target = goal.target
        if target is not None and target.apart:
            tools = [self._model.pose(q, hand.named("tool")) for hand in self._model.description.hands]
            pairs = zip(tools, target.of_hands(tools), strict=True)
            twists = (steering.hand_twist(tool, place, self._gains, target.pace) for tool, place in pairs)
            return dict(enumerate(twists))
        going = self._model.number
        if target is not None and target.also is not None:
            tool = self._model.pose(q, self._model.description.hands[1 - going].named("tool"))
            other = steering.hand_twist(tool, target.also, self._gains, target.pace)
            return {going: goal.hand, 1 - going: other}
        if target is not None and target.second is not None:
            return {going ^ target.second: goal.hand, 1 - (going ^ target.second): np.zeros(6)}
        return {going: goal.hand}

    def _joint_velocities(self, goal: steering.MotionGoal, q: FloatArray) -> FloatArray:
        """Return what the expert makes of a goal on all joints, (n,), within full stick."""
        base = turned(goal.base, q[2]) if self._base else np.zeros(0)
        twists = self._twists(goal, q)
        if goal.target is not None and len(twists) == 1 and self._turn.is_ahead(goal.target, q):
            arm = self._turn.arm_velocity(goal.target, q, goal.target.base[: self._base])
            return np.concatenate([base, arm])
        return self._inner_kinematics(twists, base, q)

    def _inner_kinematics(self, twists: dict[int, FloatArray], base: FloatArray, q: FloatArray) -> FloatArray:
        """Return the expert's inner inverse kinematics, (n,): the hands first, the base when it can."""
        size, home = self._model.size, self._model.description.home - q
        home[: self._base] = 0.0
        weights = np.full(size, _DAMPING) / self._model.description.limits.velocity
        posture = _POSTURE * np.any([*twists.values()]) * np.eye(size)[self._base :]
        tools = (self._model.description.hands[hand].named("tool") for hand in twists)
        rows = [*(self._model.jacobian(q, tool) * self._used for tool in tools), np.diag(weights), posture]
        targets = [*twists.values(), np.zeros(size), posture @ (_RETURN * home)]
        if len(base):
            rows.append(_BASE_WEIGHT * np.eye(len(base), size))
            targets.append(_BASE_WEIGHT * base)
        solution: FloatArray = np.linalg.lstsq(np.vstack(rows), np.concatenate(targets), rcond=None)[0]
        return solution / max(1.0, float(np.max(np.abs(solution) / self.full[self.channels.joint_slice])))


class LeaderArmMap(StickMap):
    """Absolute joint targets from one hand, a stick for the base in the other, both at once; no switching.

    How fast base and arm shall move is what an expert on velocity sticks finds (`StickMap`). The leader's
    joints q_L are taken along so fast, and the robot is sent `q̇ = q̇_L + k (q_L − q)`. The leader starts
    where the arm is, so that nothing jumps.
    """

    def reset(self, view: View, settings: HumanSettings, rng: np.random.Generator) -> None:
        """Take hold of the leader, which stands as the arm does."""
        super().reset(view, settings, rng)
        self._leader, self._time = view.state.q[self._base :].copy(), view.state.time

    def wanted(self, goal: steering.MotionGoal, state: State) -> tuple[BoolArray, FloatArray]:
        """Return the mask, base stick and arm together, and how fast the leader shall be moved."""
        velocity, values = self._joint_velocities(goal, state.q), np.zeros(self.channels.size)
        if self._base:
            values[self.channels.base_slice] = turned(velocity[: self._base], -state.q[2])
        values[self._arm] = velocity[self._base :]
        return self.mask(goal.focus), np.clip(values, -self.full, self.full)

    def sent(self, moved: FloatArray, state: State) -> FloatArray:
        """Return the base's stick, and the velocity that takes the arm's joints to the leader's."""
        limits, elapsed = self._model.description.limits, state.time - self._time
        lower, upper = limits.position_lower[self._base :], limits.position_upper[self._base :]
        self._leader = np.clip(self._leader + elapsed * moved[self._arm], lower, upper)
        self._time = state.time
        sent = moved.copy()
        sent[self._arm] += steering.FOLLOW * (self._leader - state.q[self._base :])
        return sent

    def raw(self, moved: FloatArray) -> FloatArray:
        """Return the base's deflection and the leader's joint angles [rad]."""
        raw = moved / self.full
        raw[self._arm] = self._leader
        return raw


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

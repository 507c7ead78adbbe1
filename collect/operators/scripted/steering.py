"""An operator's goal in any teleop mode, and how far they push the stick towards it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from handrail.collect.operators.modes import Focus
from handrail.collect.world.task import TaskState
from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.interface.channels import Channels
from handrail.controllers.numerics.rotation import rotation_vector, turned
from handrail.controllers.robot.model import Pose
from handrail.controllers.robot.parts import WorldScale

FOLLOW = 6.0
"""k of joints that follow a target, q̇ = k (q_target − q) [1/s]: a leader arm's, sliders', LeRobot's."""


@dataclass(frozen=True)
class Target:
    """Where a goal leads."""

    hand: Pose  # of the tool
    base: FloatArray  # where the base would stand, (x, y, θ)
    distance: float = 0.05  # from it that is near enough [m]
    angle: float = 0.2  # the same for orientation [rad]
    pace: float = 1.0  # share of the full stick
    tilt: float = np.inf  # how far the hand may lean from the pose's axis on the way there [rad]
    apart: float = 0.0
    """Between two hands that are steered as a pair, along their common y [m], where the pose is half-way; 0:
    one is steered."""
    second: bool | None = None
    """Of two hands that take turns: whether it is where the hand goes that does not begin the task; the other
    one holds still. None: the other one is not minded."""
    also: Pose | None = None
    """Where the other of two hands goes at the same time; None: nowhere."""
    meant: Pose | None = None
    """The pose itself where `hand` is as somebody sees it, who misjudges; None where it is the same."""

    def steered(self, task: TaskState) -> Pose:
        """Return where what is steered is now: a hand's tool, or what is half-way between two."""
        return task.pair if self.apart else task.tools[task.hand ^ bool(self.second)]

    def of_hands(self, tools: Sequence[Pose]) -> list[Pose]:
        """Return where the hands of a pair belong, on the sides where their tools are now."""
        pose, order = self.hand, np.sign((tools[0].position - tools[1].position) @ self.hand.rotation[:, 1])
        ways = (0.5 * self.apart * order * side * pose.rotation[:, 1] for side in (1.0, -1.0))
        return [Pose(pose.position + way, pose.rotation) for way in ways]

    @property
    def identity(self) -> bytes:
        """Bytes that stay the same while the operator only sees better how far the hand has to go."""
        numbers = [self.base, (self.meant or self.hand).rotation.ravel(), [self.distance, self.pace]]
        return np.concatenate(numbers).tobytes()


@dataclass(frozen=True)
class MotionGoal:
    """The motion that an operator wants now, in any mode."""

    hand: FloatArray  # twist of the tool, world-aligned, (6,) [m/s, rad/s]
    base: FloatArray  # twist of the base in the base frame, (3,)
    focus: Focus = "hand"  # which of the two matters now
    target: Target | None = None  # where that leads; None wants to rest
    grippers: tuple[float, ...] = ()  # of each hand, 0 open, 1 closed; all open where nothing is said

    @classmethod
    def rest(cls, focus: Focus = "hand", grippers: tuple[float, ...] = ()) -> "MotionGoal":
        """Return the goal that nothing moves."""
        return cls(np.zeros(6), np.zeros(3), focus, grippers=grippers)


@dataclass(frozen=True)
class Gains:
    """How briskly an operator steers.

    Pushing the stick in proportion to the distance to go, `v = gain · e`, obeys Fitts' law: from D to W it
    takes `ln(D / W) / gain`, a throughput of `gain / ln 2`. In people it is 1.6–2.6 bit/s with a velocity
    stick, 3.7–4.9 with a mouse: gains of 1.1–1.8 and 2.6–3.4.
    """

    gain: float = 1.2  # of the distance to go [1/s]
    hand_speed: float = 0.35  # full stick of the hand's translation [m/s]
    hand_rate: float = 0.6  # full stick of the hand's rotation [rad/s]
    base_speed: float = 0.5  # full stick of the base's translation [m/s]
    base_rate: float = 0.3  # full stick of the base's rotation [rad/s]
    joint_rate: float = 0.8  # full stick of one joint [rad/s]
    patience: float = 1.0  # how much longer than with a stick for the hand they try before they go on

    def within(self, world: WorldScale) -> "Gains":
        """Return the gains in a robot's world: as brisk, full stick made to its measure."""
        speed, rate = world.scale * world.pace, world.pace
        hand, base = speed * self.hand_speed, speed * self.base_speed
        return replace(self, hand_speed=hand, hand_rate=rate * self.hand_rate, base_speed=base)

    @property
    def full(self) -> FloatArray:
        """Full deflection of hand twist and base twist, (9,)."""
        hand = [self.hand_speed] * 3 + [self.hand_rate] * 3
        return np.array([*hand, self.base_speed, self.base_speed, self.base_rate])


def full_stick(channels: Channels, gains: Gains) -> FloatArray:
    """Return full deflection of the input on each channel, (m,) [m/s, rad/s]."""
    hand, base = gains.full[:6], gains.full[6:][: len(channels.base)]
    twists = [hand] * len(channels.hands) + ([hand, hand[:1]] if channels.pair else [])
    arm = np.full(len(channels.joints) - len(base), gains.joint_rate)
    return np.concatenate([base, *twists, base, arm])


def length(vector: FloatArray) -> float:
    """Return the norm of a vector, (n,)."""
    return math.sqrt(vector.dot(vector))


def saturated(vector: FloatArray, largest: float) -> FloatArray:
    """Return the vector, shortened to the largest norm."""
    norm = length(vector)
    return vector * (largest / norm) if norm > largest else vector


def hand_twist(tool: Pose, goal: Pose, gains: Gains, pace: float = 1.0) -> FloatArray:
    """Return the twist that steers the hand to a goal, world-aligned at the tool point, (6,).

    `v = sat(gain (p_goal - p))`, `ω = sat(gain log(R_goal Rᵀ))`; `pace` scales the largest speeds.
    """
    wanted = gains.gain * hand_errors(tool, goal)
    speeds = saturated(wanted[:3], pace * gains.hand_speed), saturated(wanted[3:], pace * gains.hand_rate)
    return np.concatenate(speeds)


@lru_cache(maxsize=1)
def hand_errors(tool: Pose, goal: Pose) -> FloatArray:
    """Return how far the hand has to go, `p_goal - p` [m], and to turn, `log(R_goal Rᵀ)` [rad], (6,)."""
    turn = rotation_vector(goal.rotation @ tool.rotation.T)
    return frozen(np.concatenate([goal.position - tool.position, turn]))


def pose_errors(tool: Pose, goal: Pose) -> tuple[float, float]:
    """Return distance [m] and angle [rad] between two poses."""
    errors = hand_errors(tool, goal)
    return length(errors[:3]), length(errors[3:])


def base_errors(q: FloatArray, goal: FloatArray) -> FloatArray:
    """Return how far the base has to go to (x, y, θ), and to turn the shorter way, in the world, (3,)."""
    turn = goal[2] - q[2]
    return np.array([*(goal[:2] - q[:2]), math.atan2(math.sin(turn), math.cos(turn))])


def base_twist(q: FloatArray, goal: FloatArray, gains: Gains) -> FloatArray:
    """Return the twist that drives the base to (x, y, θ), in the base frame, (3,)."""
    *way, turn = gains.gain * base_errors(q, goal)
    rate = min(max(turn, -gains.base_rate), gains.base_rate)
    return turned([*saturated(np.array(way), gains.base_speed), rate], -q[2])

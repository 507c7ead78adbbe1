"""What an operator wants, whatever the teleop mode."""

from dataclasses import dataclass

import numpy as np

from handrail.collect.operators.modes import Focus
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import Pose


@dataclass(frozen=True)
class Target:
    """Where a goal leads.

    Attributes:
        hand: pose of the tool.
        base: where the base would stand, (x, y, θ).
        distance: from it that is near enough [m].
        angle: the same for orientation [rad].
        pace: share of the full stick.
        tilt: how far the hand may lean from the pose's axis on the way there [rad].
        meant: the pose itself where `hand` is as somebody sees it, who misjudges; None where it is the same.
    """

    hand: Pose
    base: FloatArray
    distance: float = 0.05
    angle: float = 0.2
    pace: float = 1.0
    tilt: float = np.inf
    meant: Pose | None = None

    @property
    def identity(self) -> bytes:
        """What stays the same while the operator only sees better how far the hand has to go."""
        numbers = [self.base, (self.meant or self.hand).rotation.ravel(), [self.distance, self.pace]]
        return np.concatenate(numbers).tobytes()


@dataclass(frozen=True)
class MotionGoal:
    """What an operator wants the robot to do now, whatever the mode.

    Attributes:
        hand: twist of the tool, world-aligned, (6,) [m/s, rad/s].
        base: twist of the base in the base frame, (3,).
        focus: which of the two matters now.
        gripper: 0 open, 1 closed.
        target: where that leads; None wants to rest.
    """

    hand: FloatArray
    base: FloatArray
    focus: Focus = "hand"
    gripper: float = 0.0
    target: Target | None = None

    @classmethod
    def rest(cls, focus: Focus = "hand", gripper: float = 0.0) -> "MotionGoal":
        """Return the goal that nothing moves."""
        return cls(np.zeros(6), np.zeros(3), focus, gripper)

"""Base and arm apart: the base follows the hand to where the arm is comfortable, the arm tracks the hand."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.arm_completion import ArmCompletion
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import RobotModel

FREE = 0.1  # distance that the base does not care about [m]: small motions are the arm's
_GAIN = 1.0  # k, of the base's distance to where it should be [1/s]
_TURNING = 0.1  # k_θ, gain of the base's heading towards the hand [1/s]
_FASTEST = 0.5  # speed of the base at most [m/s]


class BaseFollowingCompletion:
    """Two controllers that share nothing but the robot; a completion.

    Base: with r the hand's place in the base frame at home and p its place now, it drives with
    `k e max(0, 1 − free / ‖e‖)`, e = p − r in the plane, and turns with `k_θ (∠p − ∠r)`: the hand stays where
    the arm is near home. It rests when nothing is asked of the hand.
    Arm: `q̇ = (JᵀJ + λW²)⁻¹ Jᵀ (twist − J_b v_base)` makes up for the base.

    Args:
        model: of the robot.
    """

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        self._arm = ArmCompletion(model)
        self._base = len(model.description.base.joints)
        self._home = self._seen_from_base(model.description.home)

    def __call__(self, q: FloatArray, previous: FloatArray, twist: FloatArray, duration: float) -> FloatArray:
        """Return the velocity inside the limits, (n,)."""
        follows = self._base and np.any(twist)
        base = self.base_velocity(q) if follows else np.zeros(self._base)
        return self._arm.velocity(q, previous, base, twist, duration)

    def base_velocity(self, q: FloatArray) -> FloatArray:
        """Return the base's velocity in the world, (3,) [m/s, rad/s]."""
        hand = self._seen_from_base(q)
        error = hand - self._home
        distance = float(np.linalg.norm(error))
        speed = min(_GAIN * max(0.0, distance - FREE), _FASTEST)
        drive = error * (speed / max(distance, 1e-9))
        bearing = np.arctan2(hand[1], hand[0]) - np.arctan2(self._home[1], self._home[0])
        rate = _TURNING * np.arctan2(np.sin(bearing), np.cos(bearing))
        return turned([*drive, rate], q[2])

    def _seen_from_base(self, q: FloatArray) -> FloatArray:
        hand = self._model.pose(q).position[:2]
        return turned(hand - q[:2], -q[2]) if self._base else hand

"""Decoupled base and arm: the base keeps the hand where the arm is comfortable, the arm tracks the hand."""

from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.arm_completion import ArmCompletion
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import RobotModel


@dataclass(frozen=True)
class DecoupledSettings:
    """Settings of the base's rule and of the arm.

    Attributes:
        gain: of the base's distance to where it should be [1/s].
        free: distance that the base does not care about [m]: small motions are the arm's.
        turning: gain of the base's heading towards the hand [1/s].
        fastest: speed of the base at most [m/s].
        damping: λ of the arm.
    """

    gain: float = 1.0
    free: float = 0.1
    turning: float = 0.1
    fastest: float = 0.5
    damping: float = 0.05


class DecoupledCompletion:
    """Two controllers that share nothing but the robot; a completion.

    Base: with r the hand's place in the base frame at home and p its place now, it drives with
    `k e max(0, 1 − free / ‖e‖)`, e = p − r in the plane, and turns with `k_θ (∠p − ∠r)`: the hand stays where
    the arm is near home. It rests when nothing is asked of the hand.
    Arm: `q̇ = (JᵀJ + λW²)⁻¹ Jᵀ (twist − J_b v_base)` makes up for the base.

    Args:
        model: of the robot.
        settings: of the rule.
    """

    def __init__(self, model: RobotModel, settings: DecoupledSettings | None = None) -> None:
        self._model = model
        self._settings = settings or DecoupledSettings()
        self._arm = ArmCompletion(model, self._settings.damping)
        self._base = len(model.description.base_joints)
        self._home = self._seen_from_base(model.description.home)

    def __call__(self, q: FloatArray, previous: FloatArray, twist: FloatArray, duration: float) -> FloatArray:
        """Return the velocity inside the limits, (n,)."""
        follows = self._base and np.any(twist)
        base = self.base_velocity(q) if follows else np.zeros(self._base)
        return self._arm.velocity(q, previous, base, twist, duration)

    def base_velocity(self, q: FloatArray) -> FloatArray:
        """Return the base's velocity in the world, (3,) [m/s, rad/s]."""
        settings, hand = self._settings, self._seen_from_base(q)
        error = hand - self._home
        distance = float(np.linalg.norm(error))
        beyond = max(0.0, distance - settings.free)
        speed = min(settings.gain * beyond, settings.fastest)
        drive = error * (speed / max(distance, 1e-9))
        bearing = np.arctan2(hand[1], hand[0]) - np.arctan2(self._home[1], self._home[0])
        rate = settings.turning * np.arctan2(np.sin(bearing), np.cos(bearing))
        return turned([*drive, rate], q[2])

    def _seen_from_base(self, q: FloatArray) -> FloatArray:
        """Return where the hand is in the base frame, in the plane, (2,) [m]."""
        hand = self._model.pose(q).position[:2]
        return turned(hand - q[:2], -q[2]) if self._base else hand

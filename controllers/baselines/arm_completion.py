"""Damped least squares on the arm: it makes up for what a tool twist asks beyond a base's motion."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.safety.limiter import Limiter

LARGEST_SPEED = 0.5  # of the tool twist that is followed [m/s]
LARGEST_RATE = 0.75  # of the tool twist that is followed [rad/s]
FREE = 0.1  # distance of the hand that a following base does not care about [m]: small motions are the arm's
_GAIN = 1.0  # k, of the base's distance to where it should be [1/s]
_TURNING = 0.1  # k_θ, gain of the base's heading towards the hand [1/s]
_FASTEST = 0.5  # speed of the base at most [m/s]


class ArmCompletion:
    """Completes a base velocity and a tool twist to a whole-body velocity inside the robot's limits.

    `q̇_arm = (JᵀJ + λW²)⁻¹ Jᵀ(v_ee − J_b v_b)` with `W = diag(1 / v_max)`; v_b is what the limits leave of
    the base velocity asked for, and the limits cut the result.

    Args:
        model: of the robot.
        damping: λ.
    """

    def __init__(self, model: RobotModel, damping: float = 0.05) -> None:
        self._model = model
        self._limiter = Limiter(model.description)
        self._base = len(model.description.base.joints)
        self._damping = np.diag(damping / model.description.limits.velocity[self._base :] ** 2)

    def velocity(
        self,
        q: FloatArray,
        previous: FloatArray,
        base_velocity: FloatArray,
        twist: FloatArray,
        duration: float,
    ) -> FloatArray:
        """Return the whole-body velocity, (n,) [m/s, rad/s].

        Args:
            q: generalised coordinates, (n,).
            previous: velocity commanded last, (n,).
            base_velocity: asked of the base coordinates, in the world frame, (b,) [m/s, rad/s].
            twist: asked of the tool, (v, ω), world-aligned, (6,) [m/s, rad/s].
            duration: of the step [s].
        """
        target = previous.copy()
        target[: self._base] = base_velocity
        target[: self._base] = self._limiter.limit(previous, target, duration, q)[0][: self._base]
        target[self._base :] = self.arm_velocity(q, target[: self._base], twist)
        return self._limiter.limit(previous, target, duration, q)[0]

    def arm_velocity(self, q: FloatArray, base_velocity: FloatArray, twist: FloatArray) -> FloatArray:
        """Return q̇_arm before any limit, (n − b,); arguments as in `velocity`."""
        jacobian = self._model.jacobian(q)
        base, arm = jacobian[:, : self._base], jacobian[:, self._base :]
        return np.linalg.solve(arm.T @ arm + self._damping, arm.T @ (twist - base @ base_velocity))


class WeldedBaseCompletion:
    """Drives the base as if the tool were welded to it in the plane; the arm does the rest.

    `ω_b = ω_z`, `v_b = v_ee − ω_z ẑ × (p_ee − p_b)`: a nominal base motion that keeps the arm's reach and
    heading. A completion of `(q, previous, twist, duration)`, as `ArmCompletion.velocity` names them.

    Args:
        model: of the robot.
    """

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        self._arm = ArmCompletion(model)
        self._mobile = bool(model.description.base.joints)

    def __call__(self, q: FloatArray, previous: FloatArray, twist: FloatArray, duration: float) -> FloatArray:
        """Return the whole-body velocity, (n,) [m/s, rad/s]."""
        twist = clamp_twist(twist)
        base = self._base_velocity(q, twist) if self._mobile else np.zeros(0)
        return self._arm.velocity(q, previous, base, twist, duration)

    def _base_velocity(self, q: FloatArray, twist: FloatArray) -> FloatArray:
        x, y = self._model.pose(q).position[:2] - q[:2]
        return np.array([twist[0] + twist[5] * y, twist[1] - twist[5] * x, twist[5]])


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


def clamp_twist(twist: FloatArray) -> FloatArray:
    """Return the twist, shortened to the largest speed and the largest rate, (6,) [m/s, rad/s]."""
    speed, rate = float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:]))
    linear, angular = LARGEST_SPEED / max(speed, LARGEST_SPEED), LARGEST_RATE / max(rate, LARGEST_RATE)
    return np.concatenate([linear * twist[:3], angular * twist[3:]])

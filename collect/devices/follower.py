"""A leader arm's part: from its readings to joint targets and the gripper."""

from collections.abc import Mapping

import numpy as np

from handrail.collect.devices.calibration import LeaderCalibration
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel

_LEAD = 0.3  # how far targets may be ahead of the arm; what is more slips [rad]


class Clutch:
    """Joint targets from a leader's motion: `q_target = q₀ + (l − l₀)`, from where both were at the grip.

    Where the arm cannot follow (a limit, an obstacle, a slow mode), the leader slips: targets stay within
    0.3 rad of the arm and within its limits, and what was too much is forgotten, so that the arm stands soon
    after the leader does, and turns back as soon as the leader does.

    Args:
        lower: limits of the arm's joints [rad], (n,).
        upper: the same.
    """

    def __init__(self, lower: FloatArray, upper: FloatArray) -> None:
        self._lower, self._upper = lower, upper
        self._offset: FloatArray | None = None

    def targets(self, engaged: bool, leader: FloatArray, arm: FloatArray) -> tuple[float, ...]:
        """Return where the arm's joints shall go [rad], (n,); nowhere, (0,), while it is let go.

        Args:
            engaged: whether the operator holds it.
            leader: the leader's joints, in the arm's terms [rad], (n,).
            arm: the arm's joints [rad], (n,).
        """
        if not engaged:
            self._offset = None
            return ()
        if self._offset is None:
            self._offset = arm - leader
        wanted = leader + self._offset
        kept = np.clip(np.clip(wanted, arm - _LEAD, arm + _LEAD), self._lower, self._upper)
        self._offset = self._offset + (kept - wanted)
        return tuple(kept.tolist())


class Follower:
    """Lets the robot's arm follow a leader that says something, while the clutch holds.

    Args:
        model: of the robot.
        calibration: of the leader for it.
    """

    def __init__(self, model: RobotModel, calibration: LeaderCalibration) -> None:
        description = model.description
        self._names, self._arm = description.arm_joints, slice(len(description.base.joints), None)
        limits = description.limits
        self._clutch = Clutch(limits.position_lower[self._arm], limits.position_upper[self._arm])
        self._calibration = calibration

    def targets(self, joints: Mapping[str, float], clutch: bool, q: FloatArray) -> tuple[float, ...]:
        """Return where the arm's joints shall go [rad], (n − b,), or nowhere, (0,).

        Args:
            joints: of the leader, in its own units.
            clutch: whether the operator holds it.
            q: joint positions of the robot, (n,).
        """
        return self._clutch.targets(clutch, self._calibration.angles(joints, self._names), q[self._arm])

    def apart(self, joints: Mapping[str, float], q: FloatArray) -> float:
        """Return how far the leader stands from the arm, at the joint where it is most [rad]."""
        difference = self._calibration.angles(joints, self._names) - q[self._arm]
        driven = [name in self._calibration.joints for name in self._names]
        return float(np.max(np.abs(difference[driven]), initial=0.0))

    def grips(self, joints: Mapping[str, float], before: bool) -> bool:
        """Return whether the gripper shall be closed; what it was before where the leader has no handle."""
        handle = self._calibration.gripper
        return handle.grips(joints, before) if handle else before

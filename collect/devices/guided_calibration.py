"""Calibrates a leader arm for a robot: one joint after the other, by what the person turns."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from handrail.collect.devices.calibration import (
    LeaderCalibration,
    LeaderGripper,
    LeaderJoint,
    calibration_file,
    save_calibration,
)
from handrail.collect.devices.leader_arm import connected, make_teleoperator
from handrail.collect.teleop_config import CalibrateConfig
from handrail.controllers.errors import HandrailError, restated
from handrail.controllers.robot.description import RobotDescription
from handrail.controllers.robot.model import load_model
from handrail.datasets.presentation.terminal import Terminal

SKIP = "-"
_UNITS = {"degrees": math.pi / 180.0, "radians": 1.0}
_LEAST = 0.25  # of a quarter turn, to count as one; of a leader without a unit a degree is one of its steps
_CLEAR = 0.5  # the second largest change over the largest one, at most
_LEAST_HANDLE = 0.08  # change of a handle [rad]; of one without a unit a degree is one of its steps

Positions = Mapping[str, float]


def calibrate(config: CalibrateConfig, ask: Callable[[str], str] = input) -> int:
    """Calibrate a leader and save that; return the exit code.

    Args:
        config: which leader, for which robot.
        ask: shows a person some words and returns what they typed.
    """
    description = load_model(config.robot).description
    teleoperator = connected(make_teleoperator(config.teleop), config.teleop.type, calibrate=True)
    try:
        calibration = _Guide(teleoperator.get_action, config.unit, ask).run(description)
    finally:
        teleoperator.disconnect()
    path = calibration_file(config.teleop, description.name)
    save_calibration(calibration, path)
    Terminal().print(f"saved: {path}")
    return 0


class _Guide:
    """Asks the person to turn this and that, and sees what changes.

    Args:
        read: returns the leader's positions.
        unit: of its joints; `other` measures it from a quarter turn.
        ask: shows words and returns what was typed.
    """

    def __init__(self, read: Callable[[], Any], unit: str, ask: Callable[[str], str]) -> None:
        self._read, self._unit, self._ask = read, unit, ask
        self._taken: set[str] = set()

    def run(self, robot: RobotDescription) -> LeaderCalibration:
        """Return the calibration for a robot."""
        found = {name: joint for name in robot.arm_joints if (joint := self._joint(name))}
        if not found:
            raise HandrailError("calibrate: expected at least one joint of the leader, got none")
        gripper = self._gripper() if robot.hands[0].gripper is not None else None
        self._ask("Stand the leader as the robot stands at the beginning, then press Enter: ")
        pose, home = self._positions(), dict(zip(robot.joints, np.asarray(robot.home), strict=True))
        joints = {
            name: LeaderJoint(joint.source, joint.scale, home[name] - joint.scale * pose[joint.source])
            for name, joint in found.items()
        }
        return LeaderCalibration(joints, gripper)

    def _joint(self, name: str) -> LeaderJoint | None:
        """Return what drives a joint of the arm; None where the person leaves it out."""
        while True:
            before = self._positions()
            typed = self._ask(
                f"{name}: turn the leader's joint that shall drive it a quarter turn, the way in which the "
                f"robot's angle grows, then press Enter ({SKIP} leaves it out): "
            )
            if typed.strip() == SKIP:
                return None
            source, change = self._moved(before)
            scale = _UNITS.get(self._unit, 0.5 * math.pi / max(abs(change), 1e-9))
            turn = abs(change) * _UNITS.get(self._unit, _UNITS["degrees"])
            if source and turn >= _LEAST * 0.5 * math.pi:
                self._taken.add(source)
                return LeaderJoint(source, math.copysign(scale, change))
            Terminal().print(
                "That was not one joint alone, not far enough, or it drives another one. Once more."
            )

    def _gripper(self) -> LeaderGripper | None:
        """Return the handle; None where the person leaves it out, or nothing moved."""
        typed = self._ask(f"Open the leader's handle, then press Enter ({SKIP} if it has none): ")
        if typed.strip() == SKIP:
            return None
        opened = self._positions()
        self._ask("Close the handle, then press Enter: ")
        source, change = self._moved(opened)
        if not source or abs(change) * _UNITS.get(self._unit, _UNITS["degrees"]) < _LEAST_HANDLE:
            Terminal().print("No handle has moved: the gripper is closed and opened by a key.")
            return None
        return LeaderGripper(source, closed=opened[source] + change, opened=opened[source])

    def _moved(self, before: Positions) -> tuple[str, float]:
        """Return what has changed most since, and by how much; nothing where that is not clear."""
        now = self._positions()
        changes = {name: now[name] - before[name] for name in before if name in now}
        order = sorted(changes, key=lambda name: -abs(changes[name]))
        most, second = [*(abs(changes[name]) for name in order), 0.0, 0.0][:2]
        if not order or order[0] in self._taken or second > _CLEAR * most:
            return "", 0.0
        return order[0], changes[order[0]]

    def _positions(self) -> Positions:
        """Return what the leader says now."""
        with restated("leader arm: cannot be read"):  # whatever a driver's code raises
            positions = {name: float(value) for name, value in self._read().items()}
        if not positions or not all(map(math.isfinite, positions.values())):
            raise HandrailError("leader arm: expected joint positions, got none that are finite numbers")
        return positions

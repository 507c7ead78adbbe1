"""Which joint of a leader arm drives which joint of the robot's arm, which way, and how far."""

import math
import shlex
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

from handrail.collect.teleop_config import LeaderConfig
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import Name, Number, check_names, decoded
from handrail.datasets.storage.atomic import explained, make_folder
from handrail.datasets.storage.strict_json import load_json, write_json

_OPEN, _CLOSED = 0.6, 0.4  # of the gripper's way: where it counts as open, and as closed


@dataclass(frozen=True)
class LeaderJoint:
    """A joint of the leader that drives one of the arm's: `q = scale · l + offset`."""

    source: Name
    """LeRobot's name of its position."""
    scale: Number
    """[rad per unit of the leader]; negative where it turns the other way."""
    offset: Number = 0.0
    """[rad]."""

    def __post_init__(self) -> None:
        """Check that it drives."""
        if self.scale == 0.0:
            raise HandrailError("scale: expected a finite number, not 0")


@dataclass(frozen=True)
class LeaderGripper:
    """The leader's handle, that closes and opens the gripper."""

    source: Name
    """LeRobot's name of its position."""
    closed: Number
    """Where it is closed, in the leader's units."""
    opened: Number

    def __post_init__(self) -> None:
        """Check that it moves."""
        if self.closed == self.opened:
            raise HandrailError("expected closed and opened to differ")

    def grips(self, reading: Mapping[str, float], before: bool) -> bool:
        """Return whether it is closed; in between, what it was before."""
        share = (reading[self.source] - self.closed) / (self.opened - self.closed)
        return before if _CLOSED < share < _OPEN else share <= _CLOSED


@dataclass(frozen=True)
class LeaderCalibration:
    """How a leader drives an arm, joint by joint; arm joints that no leader joint drives stand still."""

    joints: Mapping[str, LeaderJoint]
    gripper: LeaderGripper | None = None

    def angles(self, reading: Mapping[str, float], arm: tuple[str, ...]) -> FloatArray:
        """Return the leader's joints in the arm's terms [rad], (n,); 0 where none drives."""
        angles = np.zeros(len(arm))
        for index, name in enumerate(arm):
            if joint := self.joints.get(name):
                angles[index] = joint.scale * reading[joint.source] + joint.offset
        return angles

    @property
    def sources(self) -> tuple[str, ...]:
        """Names of the positions that a reading has to have."""
        return tuple(each.source for each in (*self.joints.values(), self.gripper) if each)


_SO_ARM = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
_SO_LEADERS = ("so100_leader", "so101_leader")
_IN_DEGREES = ("", "use_degrees=true", "use_degrees=True")


def same_arm(leader: LeaderConfig, arm: tuple[str, ...]) -> LeaderCalibration | None:
    """Return the calibration of a leader that is the arm's twin, as LeRobot's SO-100 and SO-101; else None.

    Joint by joint the same names and degrees; both are zero in the middle of their range.
    """
    if leader.type not in _SO_LEADERS or leader.options not in _IN_DEGREES or arm != _SO_ARM:
        return None
    joints = {name: LeaderJoint(f"{name}.pos", math.pi / 180.0) for name in arm}
    return LeaderCalibration(joints, LeaderGripper("gripper.pos", closed=0.0, opened=100.0))


def load_calibration(path: Path, arm: tuple[str, ...], advice: str) -> LeaderCalibration:
    """Return what a file says.

    Args:
        path: of the file.
        arm: names of the arm's joints.
        advice: the command that makes the file.
    """
    what = f"a calibration of the leader arm for this robot, which {advice} makes"
    calibration = decoded(load_json(path, what), LeaderCalibration, f"calibration {path}")
    check_names(calibration.joints, dict.fromkeys(arm), f"calibration {path}: joints")
    return calibration


def save_calibration(calibration: LeaderCalibration, path: Path) -> None:
    """Write a calibration; a crash leaves the one before."""
    with explained(f"calibration {path}"):
        make_folder(path.parent)
        write_json(path, asdict(calibration))


def calibration_file(leader: LeaderConfig, robot: str) -> Path:
    """Return where the calibration for a robot is: beside LeRobot's own one of that leader."""
    from lerobot.utils.constants import HF_LEROBOT_CALIBRATION, TELEOPERATORS

    name = "".join(c if c.isalnum() or c in "-_" else "_" for c in leader.id or "leader")
    return HF_LEROBOT_CALIBRATION / TELEOPERATORS / leader.type / f"{name}.{robot}.handrail.json"


def how_to_calibrate(leader: LeaderConfig, robot: str) -> str:
    """Return the command that calibrates a leader for a robot."""
    given = {f"--teleop.{each.name}": getattr(leader, each.name) for each in fields(LeaderConfig)}
    flags = (f"{flag}={value}" for flag, value in (*given.items(), ("--robot", robot)) if value)
    return shlex.join(["handrail-devices", "calibrate", *flags])

"""Where the calibration of a leader arm for a robot is kept, and the command that makes it."""

from pathlib import Path

from handrail.collect.teleop_config import LeaderConfig


def calibration_file(teleop: LeaderConfig, robot: str) -> Path:
    """Return where the calibration is: beside LeRobot's own one of that device.

    Args:
        teleop: which leader.
        robot: name of the robot.
    """
    from lerobot.utils.constants import HF_LEROBOT_CALIBRATION, TELEOPERATORS

    name = "".join(c if c.isalnum() or c in "-_" else "_" for c in teleop.id or "leader")
    return HF_LEROBOT_CALIBRATION / TELEOPERATORS / teleop.type / f"{name}.{robot}.handrail.json"


def how_to_calibrate(teleop: LeaderConfig, robot: str) -> str:
    """Return the command that calibrates a leader for a robot."""
    given = (
        ("--teleop.type", teleop.type),
        ("--teleop.port", teleop.port),
        ("--teleop.id", teleop.id),
        ("--teleop.options", teleop.options),
        ("--robot", robot),
    )
    return " ".join(["handrail-devices calibrate", *(f"{flag}={value}" for flag, value in given if value)])

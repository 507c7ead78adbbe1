"""The device in a person's hand, as typed settings; light to import."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro
from msgspec import Meta

from handrail.collect.flags import one_of
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.typed import NonNegative, check_settings

LEADER = "leader_arm"
_EXAMPLE = "--teleop.type=so101_leader --teleop.port=/dev/ttyACM0 --teleop.id=mine"


@dataclass(frozen=True)
class LeaderConfig:
    """Which leader arm; the flags are LeRobot's."""

    type: str = ""
    """LeRobot's name of the leader arm, such as so101_leader or koch_leader."""
    port: str = ""
    """Its port, such as /dev/ttyACM0 (lerobot-find-port finds it)."""
    id: str = ""
    """Your name for it, as you gave it to lerobot-calibrate."""
    options: str = ""
    """Other settings of that type, as use_degrees=true, with commas between."""

    def check_type(self, wanted_by: str) -> None:
        """Check that it is said which one."""
        if not self.type:
            raise HandrailError(f"{wanted_by}: expected --teleop.type, such as {_EXAMPLE}")


@dataclass(frozen=True)
class TeleopConfig(LeaderConfig):
    """The device in your hand, with --operator gamepad, spacemouse, keyboard or leader_arm."""

    beside: Literal["keyboard", "gamepad"] = "keyboard"
    """The device that moves the base beside a leader arm, and has its clutch: keyboard or gamepad."""
    map: str = ""
    """File (.toml) that gives controls another meaning; what it does not name stays as it is."""
    dead_zone: Annotated[float, Meta(ge=0, le=0.5)] = 0.12
    """Deflection of a stick that counts as none, 0 to 0.5."""
    exponent: Annotated[float, Meta(ge=1, le=3)] = 1.7
    """Curve of a stick, 1 (straight) to 3 (fine near the middle)."""

    def check(self, operator: str) -> None:
        """Check the settings.

        Args:
            operator: whose device it is.
        """
        if operator == LEADER:
            self.check_type(f"--operator {LEADER}")
        elif self.type:
            raise HandrailError(f"--teleop.type {self.type}: expected --operator {LEADER}, got {operator}")
        check_settings(self, "--teleop.")
        if self.map and not Path(self.map).expanduser().is_file():
            raise HandrailError(f"--teleop.map {self.map}: expected a .toml file, found none there")


@dataclass(frozen=True)
class CalibrateConfig:
    """Say which joint of a leader arm drives which joint of a robot's arm; needed once for each robot."""

    teleop: LeaderConfig = field(default_factory=LeaderConfig)
    robot: Annotated[str, one_of(ROBOTS)] = "ridgeback_ur10"
    """A robot, or a description file (.toml)."""
    unit: Literal["degrees", "radians", "other"] = "degrees"
    """Unit of the leader's joints: degrees, radians, or other (by your quarter turns: 23 steps or more)."""

    def check(self) -> None:
        """Check the settings."""
        self.teleop.check_type("handrail-devices calibrate")
        check_settings(self, "--")


@dataclass(frozen=True)
class ListDevicesConfig:
    """Print which devices can be driven with at this computer, and what the others lack."""


@dataclass(frozen=True)
class ShowDeviceConfig:
    """Show what a device says, until Ctrl-C; no robot moves."""

    device: tyro.conf.Positional[Literal["gamepad", "spacemouse", "keyboard", "leader_arm"]]
    """Which device."""
    teleop: TeleopConfig = field(default_factory=TeleopConfig)
    seconds: NonNegative = 0.0
    """How long; until Ctrl-C when 0."""

    def check(self) -> None:
        """Check the settings."""
        self.teleop.check(self.device)
        check_settings(self, "--")

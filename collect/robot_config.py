"""The settings of the commands that make and check robots."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from handrail.collect.flags import check_file, one_of
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.typed import check_settings
from handrail.datasets.lists import Names


@dataclass(frozen=True)
class NewRobotConfig:
    """Write a robot's description from its URDF, and a line for each guess that a person should look at."""

    urdf: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FILE")]
    """A file, or one in an installed package: example-robot-data/robots/xarm_description/urdf/xarm7.urdf."""
    hands: Names = ""
    """Link at the end of the hand; of several hands NAME=LINK each, such as left=l_tool,right=r_tool."""
    base: Literal["planar", "fixed"] = "planar"
    """Its base: planar drives (added where the URDF has none), fixed stands on the floor."""
    joints: Names = ""
    """Joints that move besides those of the hands; where none are named, those of a head."""
    output: str = ""
    """The description (.toml); beside the URDF's package by default, or here where that is installed."""
    overwrite: bool = False
    """Replace a description that is there."""

    def check(self) -> None:
        """Check the settings."""
        check_settings(self, "--")
        check_file("--output", self.output, ".toml")
        if "," in self.hands and ("" in self.frames or self.hands.count("=") > len(self.frames)):
            raise HandrailError(f"--hands {self.hands}: expected NAME=LINK of each of several hands")

    @property
    def frames(self) -> dict[str, str]:
        """The link of each hand, by its name; "" is the name of the only one."""
        pairs = [each.rpartition("=") for each in self.hands.split(",") if each]
        return {name: link for name, _, link in pairs}

    @property
    def name(self) -> str:
        """Of the robot: that of the file."""
        stem = Path(self.output or self.urdf).stem
        return re.sub(r"[^\w-]", "_", stem)


@dataclass(frozen=True)
class CheckRobotConfig:
    """Print a line for each thing that is wrong with a robot; the exit code is 1 if there is any."""

    robot: Annotated[tyro.conf.Positional[Annotated[str, one_of(ROBOTS)]], tyro.conf.arg(metavar="ROBOT")]
    """A robot, or a description file (.toml)."""
    picture: str = ""
    """Also draw its shapes, the pairs that can meet and the reach of each hand into this .png file."""

    def check(self) -> None:
        """Check the settings."""
        check_file("--picture", self.picture, ".png")

"""The channels that an operator can command, and their order."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from handrail.controllers.arrays import BoolArray
from handrail.controllers.errors import unknown_name

if TYPE_CHECKING:  # the command line asks for names of channels, and shall not wait for a robot
    from handrail.controllers.robot.description import RobotDescription

BASE = ("base.vx", "base.vy", "base.wz")
_TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
TOOL = tuple(f"ee.{axis}" for axis in _TWIST)


@dataclass(frozen=True)
class Channels:
    """The command channels of a robot: base twist, end-effector twist, joint velocities.

    The base twist is in the base frame [m/s, m/s, rad/s]; the end-effector twist is (v, ω), world-aligned
    at the tool point [m/s, rad/s]; joint velocities are dq/dt, the base's in the world frame.
    """

    base: tuple[str, ...]  # names of the base twist channels, none on a fixed base
    tool: tuple[str, ...]  # names of the end-effector twist channels
    joints: tuple[str, ...]  # names of the joint velocity channels

    @classmethod
    def of(cls, description: "RobotDescription") -> "Channels":
        """Return the channels of a robot."""
        joints = tuple(f"joint.{name}" for name in description.joints)
        hand = tuple(f"{description.end_effector.name}.{axis}" for axis in _TWIST)
        return cls(BASE if description.base.joints else (), hand, joints)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All channel names, in the order of `Intent.values`."""
        return self.base + self.tool + self.joints

    @property
    def size(self) -> int:
        """Number of channels m."""
        return len(self.names)

    @property
    def base_slice(self) -> slice:
        """Where the base twist lies."""
        return slice(0, len(self.base))

    @property
    def tool_slice(self) -> slice:
        """Where the end-effector twist lies."""
        return slice(len(self.base), len(self.base) + len(self.tool))

    @property
    def joint_slice(self) -> slice:
        """Where the joint velocities lie."""
        return slice(len(self.base) + len(self.tool), self.size)

    def mask(self, *names: str) -> BoolArray:
        """Return the mask of some channels, by name or by group (`base`, `ee`, `joint`, `arm`), (m,).

        `arm` are the joints that are not the base's.
        """
        mask = np.zeros(self.size, dtype=bool)
        for name in names:
            arm = self.joints[len(self.base) :] if name == "arm" else ()
            hit = [name in (channel, channel.split(".")[0]) or channel in arm for channel in self.names]
            if not any(hit):
                raise unknown_name("channel", name, ("base", "ee", "joint", "arm", *self.names))
            mask |= hit
        return mask

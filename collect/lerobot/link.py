"""How a teleoperator finds the simulated robot that it steers: the one of this process.

LeRobot shows a teleoperator nothing of the robot. A script must see the scene, and a page must draw it.
"""

import weakref
from typing import Protocol

from handrail.collect.lerobot.stepwise import Stepwise
from handrail.controllers.errors import HandrailError


class Steered(Protocol):
    """A simulated robot."""

    stepwise: Stepwise

    @property
    def is_connected(self) -> bool:
        """Whether it can be steered."""
        ...


_newest: list[weakref.ref[Steered]] = []


def announce(robot: Steered) -> None:
    """Take note of the robot that was made last."""
    _newest[:] = [weakref.ref(robot)]


def connected_robot() -> Steered | None:
    """Return the robot that was made last, if it is connected."""
    robot = _newest[0]() if _newest else None
    return robot if robot is not None and robot.is_connected else None


def simulated_robot(wanted_by: str) -> Steered:
    """Return the robot that was made last.

    Args:
        wanted_by: name of the teleoperator.
    """
    robot = _newest[0]() if _newest else None
    if robot is None:
        raise HandrailError(
            f"--teleop.type={wanted_by}: expected --robot.type=handrail_sim, which it sees and steers; "
            "there is no such robot in this process"
        )
    return robot

"""Why the robot does not do what is asked, in words."""

from collections.abc import Iterable, Mapping

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Status
from handrail.controllers.robot.description import RobotDescription

STATUS: Mapping[Status, str] = {
    Status.OK: "",
    Status.CLIPPED: "limited: faster than the robot may",
    Status.INVALID_STATE: "braking: the robot's state makes no sense",
    Status.INVALID_INTENT: "braking: the command makes no sense",
    Status.INVALID_SCENE: "braking: the list of things around the robot makes no sense",
    Status.STALE_INTENT: "braking: no command",
    Status.SOLVER_FAILED: "braking: no plan was found",
    Status.BACKUP: "braking: no safe way on",
}
_CLOSE = 0.02  # to a limit [rad, m]
_MOST = 2  # contacts, and joints, that are named


def reason(status: Status, contacts: Iterable[str], q: FloatArray, robot: RobotDescription) -> str:
    """Return what is in the way, the gravest first; empty where nothing is.

    Args:
        status: of the controller.
        contacts: forbidden ones, as pairs of names.
        q: of the robot, (n,) [m, rad].
        robot: it.
    """
    touching = [f"touching: {_plain(pair)}" for pair in list(contacts)[:_MOST]]
    return " · ".join(filter(None, [STATUS[status], *touching, *_at_limits(q, robot)[:_MOST]]))


def _at_limits(q: FloatArray, robot: RobotDescription) -> list[str]:
    limits, base = robot.limits, len(robot.base_joints)
    at = np.flatnonzero((q < limits.position_lower + _CLOSE) | (q > limits.position_upper - _CLOSE))
    names = [_plain(robot.joints[index].removesuffix("_joint")) for index in at if index >= base]
    edge = ["base at the edge of its area"] if np.any(at < base) else []
    return edge + [f"joint {name} at its limit" for name in names]


def _plain(name: str) -> str:
    return name.replace("_", " ")

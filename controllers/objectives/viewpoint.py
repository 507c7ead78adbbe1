"""Keep a point in a camera's view."""

import casadi as ca
import numpy as np

from handrail.controllers.arrays import BoolArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.objectives.objective import Objective, Stage
from handrail.controllers.objectives.ownership import commanded_joints, leaves_freedom, leaves_hand
from handrail.controllers.objectives.smooth import hinge, norm
from handrail.controllers.robot.description import Placement

_WIDTH = 0.02  # of the smooth hinge [rad]
_TINY = 1e-3  # of the smooth length [m]


def viewpoint(
    channels: Channels,
    frame: str,
    placement: Placement,
    half_angle: float = 0.3,
    weight: float = 0.4,
    name: str = "view",
) -> Objective:
    """Keep a point (the parameters, (3,) [m]) within a cone around a camera's optical axis.

    With the camera at c, its axis z and `d = p - c`: the smooth hinge of
    `atan2(‖z × d‖, z·d) - half_angle` [rad].

    Args:
        channels: of the robot.
        frame: of the robot that carries the camera.
        placement: of the camera in that frame; it looks along its z.
        half_angle: of the cone [rad].
        weight: of the angle beyond the cone [1/rad²].
        name: of the objective.
    """
    at, axis = np.array(placement.translation), np.array(placement.rotation)[:, 2]

    def residual(stage: Stage, p: ca.SX) -> ca.SX:
        pose = stage.pose(frame)
        to_point = p - (pose.position + pose.rotation @ at)
        optical = pose.rotation @ axis
        angle = ca.atan2(norm(ca.cross(optical, to_point), _TINY), ca.dot(optical, to_point))
        return hinge(angle - half_angle, _WIDTH)

    return Objective(
        name=name,
        residual=residual,
        reference=np.zeros(1),
        weights=lambda mask: np.array([weight * _camera_is_free(channels, frame, mask)]),
        parameters=np.zeros(3),
    )


def _camera_is_free(channels: Channels, frame: str, mask: BoolArray) -> bool:
    """Whether something that moves the camera is left to the robot."""
    if frame == "planar_base":
        return (
            leaves_freedom(channels, mask)
            and not commanded_joints(channels, mask)[: len(channels.base)].all()
        )
    return leaves_hand(channels, mask)

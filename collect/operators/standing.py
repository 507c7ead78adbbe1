"""Where a person would park the base to work at a place."""

import numpy as np
from numpy.typing import ArrayLike

from handrail.controllers.arrays import FloatArray
from handrail.controllers.model import RobotModel

_COMFORT = 0.85  # of the reach at home


def standing_point(model: RobotModel, place: ArrayLike, yaw: float = 0.0) -> FloatArray:
    """Return the base pose (x, y, θ) that has a place as far ahead as the tool is at home, a little nearer.

    The tool's offset from the base at home, turned by the yaw and shortened, is taken from the place; the
    result stays inside the position limits. A robot with a fixed base stands where it stands: (0, 0, 0).
    """
    description = model.description
    if not description.base_joints:
        return np.zeros(3)
    x, y, theta = description.home[:3]
    tool = model.pose(description.home).position[:2] - [x, y]
    offset = _rotation(yaw - theta) @ tool
    spot = np.asarray(place, dtype=float)[:2] - _COMFORT * offset
    lower, upper = description.limits.position_lower[:2], description.limits.position_upper[:2]
    return np.array([*np.clip(spot, lower, upper), yaw])


def _rotation(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])

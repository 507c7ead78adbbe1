"""How far a robot's arm reaches, against what the tasks are laid out for."""

import numpy as np

from handrail.controllers.robot.model import RobotModel

_LAID_OUT = 1.49  # of the tool ahead of the base's centre at home [m]


def reach_share(model: RobotModel) -> float:
    """Return how far the tool is from the base at home, as a share of 1.49 m, at most 1."""
    home = model.description.home
    away = model.pose(home).position[:2] - model.pose(home, "planar_base").position[:2]
    return min(1.0, float(np.linalg.norm(away)) / _LAID_OUT)

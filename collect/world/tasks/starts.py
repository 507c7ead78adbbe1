"""Where robots start, and how far their arms reach, against what the tasks are laid out for."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import RobotModel

_LAID_OUT = 1.49  # of the tool ahead of the base's centre at home [m]


def near_home(model: RobotModel, rng: np.random.Generator) -> FloatArray:
    """Return home with a little noise: 10 cm · scale, 0.15 rad, 0.05 rad in the arm's joints, (n,)."""
    base, away = len(model.description.base_joints), 0.10 * model.description.world.scale
    spread = np.concatenate([np.array([away, away, 0.15])[:base], np.full(model.size - base, 0.05)])
    return model.description.home + rng.uniform(-spread, spread)


def reach_share(model: RobotModel) -> float:
    """Return how far the tool is from the base at home, as a share of 1.49 m, at most 1."""
    home = model.description.home
    away = model.pose(home).position[:2] - model.pose(home, "planar_base").position[:2]
    return min(1.0, float(np.linalg.norm(away)) / _LAID_OUT)


def check_large(model: RobotModel, task: str) -> None:
    """Check that a robot is as large as a task's furniture, which comes in one size."""
    if model.description.world.scale < 1.0:
        raise HandrailError(
            f"task {task}: expected a robot whose world has scale 1, got {model.description.name} "
            f"with {model.description.world.scale}; it can do reach and pick_place"
        )

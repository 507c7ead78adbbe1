"""Robots for tests."""

from dataclasses import replace

import numpy as np

from handrail.controllers.robot.description import RobotDescription
from handrail.controllers.robot.model import RobotModel


def without_shapes(description: RobotDescription) -> RobotModel:
    """Return a robot that can meet nothing, without a gripper."""
    hand = replace(description.end_effector, gripper=None)
    nothing = {"collision": (), "self_pairs": (), "self_margins": np.zeros(0)}
    return RobotModel(replace(description, end_effector=hand, **nothing))

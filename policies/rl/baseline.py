"""The reinforcement-learning baseline in the goal-reaching benchmark."""

from typing import cast

from handrail.controllers.interface.controller import Controller
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.policies.rl.controller import RlController


def build(model: RobotModel) -> Controller:
    """Return the trained actor's controller."""
    return RlController(model)


def aim(controller: Controller, goal: Pose) -> None:
    """Tell it the goal: the baseline's observation has it."""
    cast(RlController, controller).aim(goal)

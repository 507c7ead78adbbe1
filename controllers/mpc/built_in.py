"""The objectives of the paper's stage cost."""

import numpy as np

from handrail.controllers.interface.channels import Channels
from handrail.controllers.objectives.objective import Objective
from handrail.controllers.objectives.regularisation import (
    acceleration_regularisation,
    posture,
    velocity_regularisation,
)
from handrail.controllers.objectives.tracking import tracking
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import RobotModel


def built_in_objectives(
    model: RobotModel, channels: Channels, settings: MpcSettings
) -> tuple[Objective, ...]:
    """Return the objectives that every masked MPC has: tracking first, then the regularisation."""
    base = len(model.description.base_joints)
    arm = np.arange(model.size) >= base
    velocity = np.where(arm, settings.arm_velocity, settings.base_velocity)
    commanded = np.full(channels.size, settings.tracking)
    commanded[channels.tool_slice][3:] = settings.turn_tracking
    return (
        tracking(channels, commanded),
        velocity_regularisation(channels, velocity),
        acceleration_regularisation(np.full(model.size, settings.acceleration)),
        posture(channels, model.description.home, settings.posture * arm),
    )

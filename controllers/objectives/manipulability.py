"""Keep the arm away from singularities."""

import casadi as ca
import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.objectives.objective import Objective, Stage
from handrail.controllers.objectives.ownership import leaves_arm
from handrail.controllers.objectives.smooth import hinge
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.symbolic import symbolic_pose

_WIDTH = 0.02  # of the smooth hinge
_DAMPING = 1e-6  # keeps the logarithm finite at a singularity


def manipulability(
    channels: Channels, wanted: float = 0.3, weight: float = 0.2, name: str = "manipulability"
) -> Objective:
    """Keep Yoshikawa's measure of the arm `w = √det(J Jᵀ + ε I)` above what is wanted.

    The residual is the smooth hinge of `log(wanted / w)`. J holds the arm's columns of the tool's Jacobian;
    w does not depend on where the base stands.

    Args:
        channels: of the robot.
        wanted: measure below which the objective acts; metres to the power of 3.
        weight: of the logarithm.
        name: of the objective.
    """
    return Objective(
        name=name,
        residual=lambda stage, p: hinge(
            np.log(wanted) - log_manipulability(stage, len(channels.base)), _WIDTH
        ),
        reference=np.zeros(1),
        weights=lambda mask: np.array([weight * leaves_arm(channels, mask)]),
    )


def log_manipulability(stage: Stage, base: int) -> ca.SX:
    """Return `log √det(J Jᵀ + ε I)` of the arm's columns, or of `Jᵀ J` for an arm of fewer than six joints.

    Args:
        stage: whose q is meant.
        base: number of base coordinates, which come first; they are put to zero.
    """
    q = ca.vertcat(ca.SX.zeros(base, 1), stage.q[base:])
    jacobian = symbolic_pose(stage.model, q).jacobian[:, base:]
    gram = jacobian @ jacobian.T if jacobian.shape[1] >= 6 else jacobian.T @ jacobian
    factor = ca.chol(gram + _DAMPING * ca.SX.eye(gram.shape[0]))
    return ca.sum1(ca.log(ca.diag(factor)))


def measured_manipulability(model: RobotModel, q: FloatArray) -> float:
    """Return Yoshikawa's measure `√det(J Jᵀ)` of the arm at q, as the objective sees it."""
    arm = model.jacobian(q)[:, len(model.description.base_joints) :]
    gram = arm @ arm.T if arm.shape[1] >= 6 else arm.T @ arm
    return float(np.sqrt(max(np.linalg.det(gram), 0.0)))

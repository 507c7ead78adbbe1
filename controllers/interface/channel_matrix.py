"""The channels' velocities as a matrix times the robot's velocity."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import RobotModel


def channel_matrix(model: RobotModel, channels: Channels, q: FloatArray) -> FloatArray:
    """Return C with `c = C v`, every channel's velocity at q, (m, n)."""
    jacobians = [model.jacobian(q, hand.named("tool")) for hand in model.description.hands]
    rows = [*jacobians, np.eye(model.size)]
    if channels.pair:
        way = np.subtract(*(model.pose(q, hand.named("tool")).position for hand in model.description.hands))
        apart = way @ (jacobians[0] - jacobians[1])[:3] / max(float(np.linalg.norm(way)), 1e-9)
        rows[2:2] = [0.5 * (jacobians[0] + jacobians[1]), apart[None]]
    if channels.base:
        base = np.zeros((3, model.size))
        base[:, :3] = turned(np.eye(3), -q[2])
        rows.insert(0, base)
    return np.vstack(rows)

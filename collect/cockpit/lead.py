"""Where an intent would lead the robot, if it did just that: the ghosts on the page."""

import numpy as np
from scipy.spatial.transform import Rotation

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import Pose, RobotModel

AHEAD = 0.6  # how far the ghosts are ahead [s]


def hand_ahead(model: RobotModel, intent: Intent, tool: Pose, q: FloatArray) -> Pose | None:
    """Return the hand's pose within `AHEAD`, at the velocity that is asked for; None where none is."""
    channels, asked = Channels.of(model.description), _asked(intent)
    twist, joints = asked[channels.tool_slice], asked[channels.joint_slice]
    if twist.any():
        in_tool = intent.frames.tool == "tool"
        linear, angular = (tool.rotation @ part if in_tool else part for part in (twist[:3], twist[3:]))
        turn = Rotation.from_rotvec(AHEAD * angular).as_matrix()
        return Pose(tool.position + AHEAD * linear, turn @ tool.rotation)
    return model.pose(q + AHEAD * joints) if joints[len(channels.base) :].any() else None


def base_ahead(model: RobotModel, intent: Intent, q: FloatArray) -> FloatArray | None:
    """Return the base's x, y [m] and yaw [rad] in the world, (3,), within `AHEAD`; None likewise."""
    channels, asked = Channels.of(model.description), _asked(intent)
    base = slice(0, len(channels.base))
    twist, joints = asked[channels.base_slice], asked[channels.joint_slice][base]
    if twist.any():
        return q[base] + AHEAD * turned(twist, q[2] + 0.5 * AHEAD * twist[2])
    return q[base] + AHEAD * joints if joints.any() else None


def _asked(intent: Intent) -> FloatArray:
    return np.where(intent.mask, np.nan_to_num(intent.values), 0.0)

"""Where an intent leads, at the velocity that is asked for: the hands, and the base."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import Pose, RobotModel

AHEAD = 0.6  # how far the ghosts of the page are ahead of the robot [s]


def hands_ahead(
    model: RobotModel, intent: Intent, tools: Sequence[Pose], q: FloatArray, within: float = AHEAD
) -> tuple[Pose | None, ...]:
    """Return each hand's pose within a time [s], at the velocity that is asked for; None where none is."""
    channels, asked = Channels.of(model.description), _asked(intent)
    pair, joints = asked[channels.pair_slice], asked[channels.joint_slice]
    if pair.any():
        return _pair_ahead(within * pair, tools, intent.frames.tool == "tool")
    moved, found = joints[len(channels.base) :].any(), list[Pose | None]()
    for number, (hand, tool) in enumerate(zip(model.description.hands, tools, strict=True)):
        twist = within * asked[channels.hand_slice(number)]
        if twist.any():
            axes = tool.rotation if intent.frames.tool == "tool" else np.eye(3)
            found.append(_moved(tool, axes @ twist[:3], axes @ twist[3:], tool.position))
        else:
            found.append(model.pose(q + within * joints, hand.named("tool")) if moved else None)
    return tuple(found)


def _pair_ahead(pair: FloatArray, tools: Sequence[Pose], in_tool: bool) -> tuple[Pose, ...]:
    """Return the poses of two hands that move as one body about the middle between them, and part."""
    axes = tools[0].rotation if in_tool else np.eye(3)
    way = tools[1].position - tools[0].position
    parting = 0.5 * pair[6] * way / max(float(np.linalg.norm(way)), 1e-9)
    middle, linear, angular = tools[0].position + 0.5 * way, axes @ pair[:3], axes @ pair[3:6]
    one, other = tools
    return (_moved(one, linear - parting, angular, middle), _moved(other, linear + parting, angular, middle))


def _moved(tool: Pose, linear: FloatArray, angular: FloatArray, about: FloatArray) -> Pose:
    """Return a pose that has gone along, and has turned about a point."""
    turn = Rotation.from_rotvec(angular).as_matrix()
    return Pose(about + turn @ (tool.position - about) + linear, turn @ tool.rotation)


def base_ahead(model: RobotModel, intent: Intent, q: FloatArray, within: float = AHEAD) -> FloatArray | None:
    """Return the base's x, y [m] and yaw [rad] in the world, (3,), within a time [s]; None likewise."""
    channels, asked = Channels.of(model.description), _asked(intent)
    base = slice(0, len(channels.base))
    twist, joints = asked[channels.base_slice], asked[channels.joint_slice][base]
    if twist.any():
        return q[base] + within * turned(twist, q[2] + 0.5 * within * twist[2])
    return q[base] + within * joints if joints.any() else None


def _asked(intent: Intent) -> FloatArray:
    return np.where(intent.mask, np.nan_to_num(intent.values), 0.0)

"""Where what is asked would lead the robot, if it did just that: the ghosts on the page."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import Pose, RobotModel

AHEAD = 0.6  # how far the ghosts are ahead [s]


@dataclass(frozen=True)
class Lead:
    """Where the intent leads.

    Attributes:
        hand: its pose; None where nobody asks it to move.
        base: x, y [m] and yaw [rad] in the world, (3,); None likewise.
    """

    hand: Pose | None = None
    base: FloatArray | None = None


class Leads:
    """Finds where intents lead.

    Args:
        model: of the robot.
    """

    def __init__(self, model: RobotModel) -> None:
        self._model, self._channels = model, Channels.of(model.description)
        self._base = len(self._channels.base)

    def find(self, intent: Intent, tool: Pose, q: FloatArray) -> Lead:
        """Return where an intent leads within `AHEAD`, at the velocity that it asks for.

        Args:
            intent: what is asked.
            tool: where the hand is.
            q: of the robot, (n,) [m, rad].
        """
        asked = np.where(intent.mask, np.nan_to_num(intent.values), 0.0)
        twist, joints = asked[self._channels.tool_slice], asked[self._channels.joint_slice]
        hand = None
        if twist.any():
            hand = _moved(tool, twist, intent.frames.tool == "tool")
        elif joints[self._base :].any():
            hand = self._model.pose(q + AHEAD * joints)
        return Lead(hand, self._base_ahead(asked[self._channels.base_slice], joints, q))

    def _base_ahead(self, twist: FloatArray, joints: FloatArray, q: FloatArray) -> FloatArray | None:
        base = slice(0, self._base)
        if twist.any():
            return q[base] + AHEAD * turned(twist, q[2] + 0.5 * AHEAD * twist[2])
        return q[base] + AHEAD * joints[base] if joints[base].any() else None


def _moved(tool: Pose, twist: FloatArray, in_tool: bool) -> Pose:
    """Return a pose moved by a twist (v, ω), (6,), meant in the world or in the tool, for `AHEAD`."""
    linear, angular = (tool.rotation @ part if in_tool else part for part in (twist[:3], twist[3:]))
    turn = Rotation.from_rotvec(AHEAD * angular).as_matrix()
    return Pose(tool.position + AHEAD * linear, turn @ tool.rotation)

"""The view of a policy: the recorded numbers, seen from the robot instead of from the world.

With `R_wb` the base's heading and `(p_t, R_t)` the tool's pose, the pose `(p_o, R_o)` of an object becomes

    p = R_wbᵀ (p_o − p_t)       where it is from the tool, in the base's axes [m], (3,)
    E = R_wbᵀ R_o R_tᵀ R_wb     what turns the tool's axes into the object's, in the base's axes, (9,)

    n_r = p / √(|p|² + r²)      the same up close, for several r: a direction from afar, (3,) each

and the tool itself is seen from the base: `R_wbᵀ (p_t − p_b)`, `R_wbᵀ R_t`. So a motion learnt in one place
is the same motion everywhere, and what an operator steers to zero is an input. With several hands an object
is seen from each of them (`goal.left.dx`), and each tool from the base (`left.tool.x`). `E` is smooth, unlike
a rotation vector; `p` and `E − Eᵀ` vanish at the goal.

Operators also steer by where the base is: who steers joints drives it to where they mean to stand, with a
heading in the world's axes. So it is seen too, `(x, y, cos θ, sin θ)` in the frame of the joint positions, in
which every episode begins at home or up to 10 cm beside it. Seen from its own start, that little would be
hidden, and every operator plans in the world.

The robot's own velocities are left out: the next joint velocity is nearly the present one, so a policy that
sees them learns to go on as it goes, and stays at rest where it once comes to rest.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import turned

POSITION = ("x", "y", "z")
POSE = (*POSITION, "qw", "qx", "qy", "qz")
_NEAR = (0.05, 0.25)  # r: from where on being near is told finely [m]
_OFFSET = ("dx", "dy", "dz", *(f"near_{r:g}.{axis}" for r in _NEAR for axis in POSITION))
_MATRIX = tuple(f"r{row}{column}" for row in range(3) for column in range(3))
SEEN = {POSE: (*_OFFSET, *_MATRIX), POSITION: _OFFSET}
"""The names of what a policy reads of an object, by those of its numbers; of other numbers as they are."""
TOOL_SEEN = (*POSITION, *_MATRIX)
"""The names of what a policy reads of a tool, behind the tool's own."""
BASE_SEEN = ("base.x", "base.y", "base.cos", "base.sin")


@dataclass(frozen=True)
class RobotPose:
    """Where the robot is, at T moments."""

    base: FloatArray
    """The base's x, y and heading, (T, 3) [m, rad]."""
    tool: FloatArray
    """The tool's position, (T, 3) [m]."""
    rotation: FloatArray
    """The tool's rotation, (T, 3, 3)."""

    def turned(self, vectors: FloatArray) -> FloatArray:
        """Return world vectors in the base's axes; z stays, (T, 2 or 3)."""
        return turned(vectors.T, -self.base[:, 2]).T

    def turned_back(self, vectors: FloatArray) -> FloatArray:
        """Return vectors in the base's axes in the world's; z stays, (T, 2 or 3)."""
        return turned(vectors.T, self.base[:, 2]).T

    @cached_property
    def matrices(self) -> FloatArray:
        """`R_wb`, (T, 3, 3)."""
        base = np.tile(np.eye(3), (len(self.base), 1, 1))
        base[:, :2, :2] = turned(np.eye(2)[:, :, None], self.base[:, 2]).transpose(2, 0, 1)
        return base

    @property
    def tool_seen(self) -> FloatArray:
        """The tool from the base, as `TOOL_SEEN`, (T, 12)."""
        place = np.column_stack([self.tool[:, :2] - self.base[:, :2], self.tool[:, 2]])
        turn = self.matrices.transpose(0, 2, 1) @ self.rotation
        return np.column_stack([self.turned(place), turn.reshape(-1, 9)])

    @property
    def base_seen(self) -> FloatArray:
        """The base in the frame of the joint positions, as `BASE_SEEN`, (T, 4)."""
        yaw = self.base[:, 2]
        return np.column_stack([self.base[:, :2], np.cos(yaw), np.sin(yaw)])


def seen(parts: tuple[str, ...], numbers: FloatArray, pose: RobotPose, turn_velocity: bool) -> FloatArray:
    """Return an object as seen from the robot, (T, k).

    Args:
        parts: names of its numbers.
        numbers: as recorded, (T, p).
        pose: of the robot.
        turn_velocity: whether the velocity of a moving obstacle is turned too.
    """
    if parts in SEEN:
        offset = pose.turned(numbers[:, :3] - pose.tool)
        square = np.sum(offset**2, axis=1, keepdims=True)
        found = [offset, *(offset / np.sqrt(square + r * r) for r in _NEAR)]
        if parts == POSE:
            turn = rotations(numbers[:, 3:]) @ pose.rotation.transpose(0, 2, 1)
            found.append((pose.matrices.transpose(0, 2, 1) @ turn @ pose.matrices).reshape(-1, 9))
        return np.column_stack(found)
    if parts == ("nx", "ny"):
        return pose.turned(numbers)
    if parts[:2] == ("x", "y"):
        there = numbers.any(axis=1, keepdims=True)  # what is not there stays zero
        place = pose.turned(numbers[:, :2] - pose.base[:, :2])
        velocity, others = np.split(numbers[:, 2:], [2 if parts[2:4] == ("vx", "vy") else 0], axis=1)
        velocity = pose.turned(velocity) if turn_velocity and velocity.size else velocity
        return np.column_stack([np.where(there, place, 0.0), velocity, others])
    return numbers


def rotations(quaternions: FloatArray) -> FloatArray:
    """Return the matrices of quaternions `wxyz`, (T, 3, 3)."""
    return Rotation.from_quat(quaternions, scalar_first=True).as_matrix()

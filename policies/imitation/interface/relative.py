"""What a policy sees: the recorded numbers, seen from the robot instead of from the world.

With `R_wb` the base's heading and `(p_t, R_t)` the tool's pose, the pose `(p_o, R_o)` of an object becomes

    p = R_wbᵀ (p_o − p_t)       where it is from the tool, in the base's axes [m], (3,)
    E = R_wbᵀ R_o R_tᵀ R_wb     what turns the tool's axes into the object's, in the base's axes, (9,)

    n_r = p / √(|p|² + r²)      the same up close, for several r: a direction from afar, (3,) each

and the tool itself is seen from the base: `R_wbᵀ (p_t − p_b)`, `R_wbᵀ R_t`. So a motion learnt in one place
is the same motion everywhere, and what an operator steers to zero is an input. `E` is smooth, unlike a
rotation vector; `p` and `E − Eᵀ` vanish at the goal.

Operators also steer by where the base is: who steers joints drives it to where they mean to stand, with a
heading in the world's axes. So it is seen too, `(x, y, cos θ, sin θ)` in the frame of the joint positions, in
which every episode begins at home or up to 10 cm beside it. Seen from its own start, that little would be
hidden, and every operator plans in the world.

The robot's own velocities are left out: the next joint velocity is nearly the present one, so a policy that
sees them learns to go on as it goes, and stays at rest where it once comes to rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import turned

_POSITION = ("x", "y", "z")
_QUATERNION = ("qw", "qx", "qy", "qz")
_POSE = (*_POSITION, *_QUATERNION)
_DIRECTION = ("nx", "ny")
_NEAR = (0.05, 0.25)  # r: from where on being near is told finely [m]
_MATRIX = tuple(f"r{row}{column}" for row in range(3) for column in range(3))
_TOOL = tuple(f"tool.{axis}" for axis in _POSE)
_BASE = ("base.x", "base.y", "base.cos", "base.sin")


@dataclass(frozen=True)
class RelativeGroup:
    """Numbers of the environment that belong together.

    Attributes:
        name: of the object.
        parts: what follows the dot in each name.
        start: where they begin.
    """

    name: str
    parts: tuple[str, ...]
    start: int

    @property
    def end(self) -> int:
        """Where they end."""
        return self.start + len(self.parts)


@dataclass(frozen=True)
class RobotPose:
    """Where the robot is, at T moments.

    Attributes:
        base: the base's x and y, (T, 2) [m].
        yaw: the base's heading, (T,) [rad].
        tool: the tool's position, (T, 3) [m].
        rotation: the tool's rotation, (T, 3, 3).
    """

    base: FloatArray
    yaw: FloatArray
    tool: FloatArray
    rotation: FloatArray

    def turned(self, vectors: FloatArray) -> FloatArray:
        """Return world vectors in the base's axes; z stays, (T, 2 or 3)."""
        return turned(vectors.T, -self.yaw).T

    def turned_back(self, vectors: FloatArray) -> FloatArray:
        """Return vectors in the base's axes in the world's; z stays, (T, 2 or 3)."""
        return turned(vectors.T, self.yaw).T

    def conjugated(self, rotations: FloatArray) -> FloatArray:
        """Return `R_wbᵀ R R_wb`, (T, 9)."""
        base = self.matrices()
        return (base.transpose(0, 2, 1) @ rotations @ base).reshape(-1, 9)

    def matrices(self) -> FloatArray:
        """Return `R_wb`, (T, 3, 3)."""
        base = np.tile(np.eye(3), (len(self.yaw), 1, 1))
        base[:, :2, :2] = turned(np.eye(2)[:, :, None], self.yaw).transpose(2, 0, 1)
        return base


@dataclass(frozen=True)
class RelativeView:
    """Turns recorded observations into what a policy reads.

    Attributes:
        state_names: of `observation.state` as recorded, (s,).
        environment_names: of `observation.environment_state` as recorded, (e,).
        joints: of the robot, (n,).
        mobile: whether the first three joints are a base's x, y and heading.
        base_pose: whether it shows where the base is.
    """

    state_names: tuple[str, ...]
    environment_names: tuple[str, ...]
    joints: tuple[str, ...]
    mobile: bool
    base_pose: bool = False

    def __post_init__(self) -> None:
        """Check that what the view starts from is there."""
        needed = (*_TOOL, *(f"{joint}.{kind}" for joint in self.joints for kind in ("pos", "vel")))
        missing = [name for name in needed if name not in self.state_names]
        if missing:
            raise HandrailError(
                f"observation.state: expected {', '.join(needed[:9])}, … as handrail-record writes it;"
                f" missing: {', '.join(missing)}"
            )

    @property
    def names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """What the numbers are called: of the state, of the environment."""
        tool = (*_TOOL[:3], *(f"tool.{entry}" for entry in _MATRIX))
        environment = tuple(f"{group.name}.{part}" for group in self._groups for part in _parts(group))
        return (*self._own, *tool, *(_BASE if self._shows_base else ())), environment

    def __call__(self, state: FloatArray, environment: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return both as the policy reads them, (T, s') and (T, e') float32.

        Args:
            state: as recorded, (T, s).
            environment: as recorded, (T, e).
        """
        state, environment = np.asarray(state, float), np.asarray(environment, float)
        pose = self.pose(state)
        place = np.column_stack([pose.tool[:, :2] - pose.base, pose.tool[:, 2]])
        own = (
            self._of(state, self._own),
            pose.turned(place),
            (pose.matrices().transpose(0, 2, 1) @ pose.rotation).reshape(-1, 9),
            *((pose.base, np.cos(pose.yaw), np.sin(pose.yaw)) if self._shows_base else ()),
        )
        seen = [_seen(group, environment[:, group.start : group.end], pose) for group in self._groups]
        around = np.column_stack(seen) if seen else np.zeros((len(state), 0))
        return np.column_stack(own).astype(np.float32), around.astype(np.float32)

    def pose(self, state: FloatArray) -> RobotPose:
        """Return where the robot is, from recorded states, (T, s)."""
        base = np.zeros((len(state), 3))
        if self.mobile:
            base = self._of(state, [f"{joint}.pos" for joint in self.joints[:3]])
        tool = self._of(state, _TOOL)
        rotation = Rotation.from_quat(tool[:, 3:], scalar_first=True).as_matrix()
        return RobotPose(base[:, :2], base[:, 2], tool[:, :3], rotation)

    def velocities(self, state: FloatArray) -> FloatArray:
        """Return the joint velocities in recorded states, (T, n)."""
        return self._of(state, [f"{joint}.vel" for joint in self.joints])

    @property
    def _shows_base(self) -> bool:
        return self.base_pose and self.mobile

    @cached_property
    def _own(self) -> tuple[str, ...]:
        """The arm's joints, and numbers of the state that are neither a joint's nor the tool's."""
        known = {*_TOOL, *(f"{joint}.{kind}" for joint in self.joints for kind in ("pos", "vel"))}
        arm = self.joints[3:] if self.mobile else self.joints
        others = (name for name in self.state_names if name not in known)
        return (*(f"{joint}.pos" for joint in arm), *others)

    @cached_property
    def _groups(self) -> tuple[RelativeGroup, ...]:
        return grouped(self.environment_names)

    def _of(self, state: FloatArray, names: Sequence[str]) -> FloatArray:
        return state[:, [self.state_names.index(name) for name in names]]


def grouped(names: Sequence[str]) -> tuple[RelativeGroup, ...]:
    """Return neighbouring names with the same beginning as groups."""
    groups: list[RelativeGroup] = []
    for index, name in enumerate(names):
        head, _, part = name.rpartition(".")
        if groups and groups[-1].name == head and part not in groups[-1].parts:
            last = groups[-1]
            groups[-1] = RelativeGroup(last.name, (*last.parts, part), last.start)
        else:
            groups.append(RelativeGroup(head, (part,), index))
    return tuple(groups)


def _parts(group: RelativeGroup) -> tuple[str, ...]:
    offset = ("dx", "dy", "dz", *(f"near_{r:g}.{axis}" for r in _NEAR for axis in _POSITION))
    if group.parts == _POSE:
        return (*offset, *_MATRIX)
    if group.parts == _POSITION:
        return offset
    return group.parts


def _seen(group: RelativeGroup, numbers: FloatArray, pose: RobotPose) -> FloatArray:
    """Return a group as seen from the robot, (T, k)."""
    if group.parts[:3] == _POSITION and group.parts in (_POSE, _POSITION):
        offset = _at_scales(pose.turned(numbers[:, :3] - pose.tool))
        if group.parts == _POSITION:
            return offset
        turn = Rotation.from_quat(numbers[:, 3:], scalar_first=True).as_matrix()
        return np.column_stack([offset, pose.conjugated(turn @ pose.rotation.transpose(0, 2, 1))])
    if group.parts == _DIRECTION:
        return pose.turned(numbers)
    if group.parts[:2] == ("x", "y"):
        there = numbers.any(axis=1, keepdims=True)  # what is not there stays zero
        place = pose.turned(numbers[:, :2] - pose.base)
        return np.column_stack([np.where(there, place, 0.0), numbers[:, 2:]])
    return numbers


def _at_scales(offset: FloatArray) -> FloatArray:
    """Return an offset, and how near it is at several scales, (T, 3 + 3 k)."""
    square = np.sum(offset**2, axis=1, keepdims=True)
    return np.column_stack([offset, *(offset / np.sqrt(square + r * r) for r in _NEAR)])

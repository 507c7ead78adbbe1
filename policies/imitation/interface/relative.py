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
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import turned

_POSITION = ("x", "y", "z")
_POSE = (*_POSITION, "qw", "qx", "qy", "qz")
_DIRECTION = ("nx", "ny")
_NEAR = (0.05, 0.25)  # r: from where on being near is told finely [m]
_OFFSET = ("dx", "dy", "dz", *(f"near_{r:g}.{axis}" for r in _NEAR for axis in _POSITION))
_MATRIX = tuple(f"r{row}{column}" for row in range(3) for column in range(3))
_TOOL = tuple(f"tool.{part}" for part in _POSE)
_BASE = ("base.x", "base.y", "base.cos", "base.sin")


@dataclass(frozen=True)
class RobotPose:
    """Where the robot is, at T moments."""

    base: FloatArray
    """The base's x and y, (T, 2) [m]."""
    yaw: FloatArray
    """The base's heading, (T,) [rad]."""
    tool: FloatArray
    """The tool's position, (T, 3) [m]."""
    rotation: FloatArray
    """The tool's rotation, (T, 3, 3)."""

    def turned(self, vectors: FloatArray) -> FloatArray:
        """Return world vectors in the base's axes; z stays, (T, 2 or 3)."""
        return turned(vectors.T, -self.yaw).T

    def turned_back(self, vectors: FloatArray) -> FloatArray:
        """Return vectors in the base's axes in the world's; z stays, (T, 2 or 3)."""
        return turned(vectors.T, self.yaw).T

    @cached_property
    def matrices(self) -> FloatArray:
        """`R_wb`, (T, 3, 3)."""
        base = np.tile(np.eye(3), (len(self.yaw), 1, 1))
        base[:, :2, :2] = turned(np.eye(2)[:, :, None], self.yaw).transpose(2, 0, 1)
        return base


@dataclass(frozen=True)
class RelativeGroup:
    """Neighbouring numbers of the environment whose names begin alike: of one object."""

    name: str
    parts: tuple[str, ...]
    """What follows the dot in each name."""
    start: int
    """Where they begin."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what the policy reads of it."""
        known = {_POSE: (*_OFFSET, *_MATRIX), _POSITION: _OFFSET}
        return tuple(f"{self.name}.{part}" for part in known.get(self.parts, self.parts))

    def seen(self, environment: FloatArray, pose: RobotPose) -> FloatArray:
        """Return the group as seen from the robot, (T, k), of the environment as recorded, (T, e)."""
        numbers = environment[:, self.start : self.start + len(self.parts)]
        if self.parts in (_POSE, _POSITION):
            offset = pose.turned(numbers[:, :3] - pose.tool)
            square = np.sum(offset**2, axis=1, keepdims=True)
            seen = [offset, *(offset / np.sqrt(square + r * r) for r in _NEAR)]
            if self.parts == _POSE:
                turn = Rotation.from_quat(numbers[:, 3:], scalar_first=True).as_matrix()
                turn, base = turn @ pose.rotation.transpose(0, 2, 1), pose.matrices
                seen.append((base.transpose(0, 2, 1) @ turn @ base).reshape(-1, 9))
            return np.column_stack(seen)
        if self.parts == _DIRECTION:
            return pose.turned(numbers)
        if self.parts[:2] == ("x", "y"):
            there = numbers.any(axis=1, keepdims=True)  # what is not there stays zero
            place = pose.turned(numbers[:, :2] - pose.base)
            return np.column_stack([np.where(there, place, 0.0), numbers[:, 2:]])
        return numbers


@dataclass(frozen=True)
class RelativeView:
    """Turns recorded observations into what a policy reads."""

    state_names: tuple[str, ...]
    """Of `observation.state` as recorded, (s,)."""
    environment_names: tuple[str, ...]
    """Of `observation.environment_state` as recorded, (e,)."""
    joints: tuple[str, ...]
    """Of the robot, (n,)."""
    mobile: bool
    """Whether the first three joints are a base's x, y and heading."""
    base_pose: bool = False
    """Whether it shows where the base is."""

    def __post_init__(self) -> None:
        """Check that what the view starts from is there."""
        missing = [name for name in self._needed if name not in self.state_names]
        if missing:
            raise HandrailError(
                f"observation.state: expected that of handrail-record; no {', '.join(missing)}"
            )

    @property
    def names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Names of the numbers: of the state, of the environment."""
        tool = (*_TOOL[:3], *(f"tool.{entry}" for entry in _MATRIX))
        environment = tuple(name for group in self._groups for name in group.names)
        return (*self._own, *tool, *(_BASE if self._shows_base else ())), environment

    def __call__(self, state: FloatArray, environment: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what the policy reads, (T, s') and (T, e') float32, of what is recorded, (T, s), (T, e)."""
        state, environment = np.asarray(state, float), np.asarray(environment, float)
        pose = self.pose(state)
        place = np.column_stack([pose.tool[:, :2] - pose.base, pose.tool[:, 2]])
        own = (
            self._of(state, self._own),
            pose.turned(place),
            (pose.matrices.transpose(0, 2, 1) @ pose.rotation).reshape(-1, 9),
            *((pose.base, np.cos(pose.yaw), np.sin(pose.yaw)) if self._shows_base else ()),
        )
        around = [group.seen(environment, pose) for group in self._groups] or [np.zeros((len(state), 0))]
        return np.column_stack(own).astype(np.float32), np.column_stack(around).astype(np.float32)

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

    @property
    def _needed(self) -> tuple[str, ...]:
        return (*_TOOL, *(f"{joint}.{kind}" for joint in self.joints for kind in ("pos", "vel")))

    @cached_property
    def _own(self) -> tuple[str, ...]:
        """The arm's joints, and numbers of the state that are neither a joint's nor the tool's."""
        arm = self.joints[3:] if self.mobile else self.joints
        others = (name for name in self.state_names if name not in self._needed)
        return (*(f"{joint}.pos" for joint in arm), *others)

    @cached_property
    def _groups(self) -> list[RelativeGroup]:
        groups: list[RelativeGroup] = []
        for index, name in enumerate(self.environment_names):
            head, _, part = name.rpartition(".")
            if groups and groups[-1].name == head and part not in groups[-1].parts:
                groups[-1] = replace(groups[-1], parts=(*groups[-1].parts, part))
            else:
                groups.append(RelativeGroup(head, (part,), index))
        return groups

    def _of(self, state: FloatArray, names: Sequence[str]) -> FloatArray:
        return state[:, [self.state_names.index(name) for name in names]]

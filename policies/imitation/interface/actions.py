"""What a policy asks for: the joint velocities that came about, or the operator's own command.

Both are written in the base's axes, like what the policy sees.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.policies.imitation.interface.relative import RelativeView, RobotPose

Columns = Mapping[str, np.ndarray]
Mask = tuple[bool, ...]
_HALF = 0.5


class Actions(Protocol):
    """An action space: from recorded columns, and to an intent."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers, (a,)."""
        ...

    def encode(self, columns: Columns) -> FloatArray:
        """Return the actions of an episode, (T, a)."""
        ...

    def decode(self, action: FloatArray, pose: RobotPose) -> Intent:
        """Return what an action (a,) asks for, where the robot is now (T = 1)."""
        ...


@dataclass(frozen=True)
class RealisedActions:
    """Joint velocities as they were one period later, and the gripper: the same space for every teleop mode.

    Attributes:
        view: where the robot's joints lie in the observation.
        channels: of the robot.
    """

    view: RelativeView
    channels: Channels

    @property
    def names(self) -> tuple[str, ...]:
        """The joints' velocities and the gripper."""
        return (*(f"{joint}.vel" for joint in self.view.joints), "gripper")

    def encode(self, columns: Columns) -> FloatArray:
        """Return the next frame's velocities; the last frame's are its own, (T, n + 1)."""
        state = columns["observation.state"].astype(float)
        velocities = self.view.velocities(state)
        following = np.concatenate([velocities[1:], velocities[-1:]])
        return np.column_stack(
            [self.view.to_base(self.view.pose(state), following), columns["action"][:, -1]]
        )

    def decode(self, action: FloatArray, pose: RobotPose) -> Intent:
        """Return an intent on every joint."""
        values = np.zeros(self.channels.size)
        values[self.channels.joint_slice] = self.view.to_world(pose, action[None, :-1])[0]
        return Intent(values, self.channels.mask("joint"), gripper=float(action[-1] > _HALF))


@dataclass(frozen=True)
class IntentActions:
    """The values on the operator's channels, which of them they own where that changes, and the gripper.

    Attributes:
        view: where the robot is in the observation.
        channels: of the robot.
        masks: every set of channels that the operator owned, (m,) each.
    """

    view: RelativeView
    channels: Channels
    masks: tuple[Mask, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The owned channels, a number for each mask if there are several, the gripper."""
        flags = tuple(f"mask.{index}" for index in range(len(self.masks))) if len(self.masks) > 1 else ()
        return (*(self.channels.names[index] for index in self._owned), *flags, "gripper")

    def encode(self, columns: Columns) -> FloatArray:
        """Return the operator's command with tool twists in the base's axes, (T, a)."""
        values = columns["teleop.values"].astype(float)
        asked, gripper = values[:, :-1].copy(), values[:, -1]
        pose = self.view.pose(columns["observation.state"].astype(float))
        for pair in self._pairs:
            asked[:, pair] = pose.turned(asked[:, pair])
        rows = columns["teleop.mask"][:, : self.channels.size].astype(bool)
        flags = [(rows == mask).all(axis=1) for mask in self.masks] if len(self.masks) > 1 else []
        return np.column_stack([asked[:, self._owned], *flags, gripper])

    def decode(self, action: FloatArray, pose: RobotPose) -> Intent:
        """Return the intent on the channels of the likeliest mask."""
        values = np.zeros((1, self.channels.size))
        values[0, self._owned] = action[: len(self._owned)]
        for pair in self._pairs:
            values[:, pair] = pose.turned_back(values[:, pair])
        flags = action[len(self._owned) : -1]
        mask = np.array(self.masks[int(np.argmax(flags)) if len(flags) else 0], dtype=bool)
        return Intent(values[0], mask, gripper=float(action[-1] > _HALF))

    @cached_property
    def _owned(self) -> list[int]:
        return np.flatnonzero(np.any(self.masks, axis=0)).tolist()

    @cached_property
    def _pairs(self) -> list[list[int]]:
        """(x, y) pairs along the world's axes; one that a mask splits stays so."""
        tool, joint = self.channels.tool_slice.start, self.channels.joint_slice.start
        starts = (tool, tool + 3, joint) if self.channels.base else (tool, tool + 3)
        whole = [start for start in starts if all(mask[start] == mask[start + 1] for mask in self.masks)]
        return [[start, start + 1] for start in whole]


def masks_of(channels: Channels, episodes: Sequence[Columns]) -> tuple[Mask, ...]:
    """Return every set of channels that an operator owned in some episodes.

    Raises:
        HandrailError: nobody steered anything in them.
    """
    masks: set[Mask] = set()
    for columns in episodes:
        rows = columns["teleop.mask"][:, : channels.size].astype(bool)
        masks |= set(map(tuple, np.unique(rows, axis=0).tolist()))
    if not any(map(any, masks)):
        raise HandrailError("intent as action: expected episodes in which an operator steers, got none")
    return tuple(sorted(masks))

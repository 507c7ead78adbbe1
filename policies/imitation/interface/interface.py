"""The inputs and outputs of a policy, and how they come from and go to Handrail's columns.

It writes the joint velocities that came about, or the operator's own command: both are values on channels, in
the base's axes like the policy's view. The robot's limits bound all of its output.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Literal

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError, shown
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent, decided_gripper
from handrail.controllers.typed import Text
from handrail.datasets.format.schema import Feature
from handrail.policies.imitation.interface.relative import (
    BASE_SEEN,
    POSE,
    SEEN,
    TOOL_SEEN,
    RobotPose,
    rotations,
    seen,
)

Columns = Mapping[str, np.ndarray]
STATE, ENVIRONMENT, ACTION = "observation.state", "observation.environment_state", "action"
VALUES, MASK = "teleop.values", "teleop.mask"
COLUMNS = (STATE, ENVIRONMENT, ACTION, VALUES, MASK)


@dataclass(frozen=True)
class PolicyInterface:
    """Between what is recorded and what a policy reads and writes; saved beside every checkpoint."""

    actions: Literal["realised", "intent"]
    """The joint velocities that came about, or the operator's own command."""
    state_names: tuple[Text, ...]
    """Of `observation.state` as recorded, (s,)."""
    environment_names: tuple[Text, ...]
    """Of `observation.environment_state` as recorded, (e,)."""
    channels: tuple[Text, ...]
    """Names of the command channels as recorded, (m,)."""
    masks: tuple[tuple[bool, ...], ...] = ()
    """The sets of channels that the operator owned, (m,) each; of `intent` alone."""
    base_pose: bool = False
    """Whether it sees where the base is; older checkpoints do not say, and do not."""
    turned_velocities: bool = False
    """Whether it sees velocities of obstacles in the base's axes; older checkpoints do not say, and see those
    in the world's axes."""

    def __post_init__(self) -> None:
        """Check the masks, and that what the view starts from is there."""
        count = len(self.channels)
        if {len(mask) for mask in self.masks} != ({count} if self.actions == "intent" else set()):
            words = f"of {count} channels each for an intent and none else"
            raise HandrailError(f"masks: expected some {words}, got {shown(self.masks)} for {self.actions}")
        if missing := [name for name in self._needed if name not in self.state_names]:
            words = f"expected that of handrail-record; no {', '.join(missing)}"
            raise HandrailError(f"observation.state: {words}")

    @classmethod
    def of_dataset(
        cls,
        features: Mapping[str, Feature],
        episodes: Iterable[Columns],
        actions: Literal["realised", "intent"],
        base_pose: bool = True,
    ) -> "PolicyInterface":
        """Return the interface of a policy that is trained on some episodes.

        Args:
            features: of the dataset.
            episodes: `MASK` of each; read only where the operator's own commands are learnt.
            actions: what it writes.
            base_pose: whether it shall see where the base is.
        """
        state, environment, values = (_names(features, key) for key in (STATE, ENVIRONMENT, VALUES))
        hands = {name.removesuffix("vx") for name in values if name.endswith(".vx")}
        grippers = {f"{hand}gripper" for hand in (*hands, "")}
        channels = tuple(name for name in values if name not in grippers)
        masks: set[tuple[bool, ...]] = set()
        for columns in episodes if actions == "intent" else ():
            rows = columns[MASK][:, : len(channels)].astype(bool)
            masks |= set(map(tuple, np.unique(rows[rows.any(axis=1)], axis=0).tolist()))  # pauses teach rest
        if actions == "intent" and not masks:
            raise HandrailError("intent as action: expected episodes in which an operator steers, got none")
        return cls(actions, state, environment, channels, tuple(sorted(masks)), base_pose, True)

    @property
    def observation_names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Names of what the policy reads: state, environment."""
        base = BASE_SEEN if self._shows_base else ()
        tools = (f"{tool}.{part}" for tool in self.tools for part in TOOL_SEEN)
        around = (
            f"{name}.{hand}{part}"
            for name, parts, _ in self.objects
            for hand in ([tool.removesuffix("tool") for tool in self.tools] if parts in SEEN else ("",))
            for part in SEEN.get(parts, parts)
        )
        return (*self._own, *tools, *base), tuple(around)

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of what the policy writes: channels, a number for each mask if several, grippers, (a,)."""
        flags = (f"mask.{index}" for index in range(len(self.masks)) if len(self.masks) > 1)
        return (*(self.channels[index] for index in self._commanded), *flags, *self._known.grippers)

    @property
    def is_partial(self) -> bool:
        """Whether it writes less than the motion of the whole robot."""
        return self.actions == "intent" and len(self._commanded) < len(self._known.joints)

    def observe(self, state: FloatArray, environment: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what the policy reads, ([T,] s') and ([T,] e') float32, of what is recorded."""
        if state.ndim == 1:
            numbers = self.observe(state[None], environment[None])
            return numbers[0][0], numbers[1][0]
        state, environment = np.asarray(state, float), np.asarray(environment, float).reshape(len(state), -1)
        poses = [self.pose(state, hand) for hand in range(len(self.tools))]
        base = [poses[0].base_seen] if self._shows_base else []
        own = [self._of(state, self._own), *(pose.tool_seen for pose in poses), *base]
        around: list[FloatArray] = [np.zeros((len(state), 0))]
        for _, parts, start in self.objects:
            numbers = environment[:, start : start + len(parts)]
            seers = poses if parts in SEEN else poses[:1]
            around += [seen(parts, numbers, pose, self.turned_velocities) for pose in seers]
        return np.column_stack(own).astype(np.float32), np.column_stack(around).astype(np.float32)

    def encode(self, columns: Columns) -> FloatArray:
        """Return the actions of a recorded episode, (T, a) float32, from its `COLUMNS`."""
        state = columns[STATE].astype(float)
        if self.masks:
            values, grippers = np.split(columns[VALUES].astype(float), [len(self.channels)], axis=1)
        else:  # the next frame's joint velocities, the last frame's its own
            velocities = self._of(state, [f"{joint}.vel" for joint in self._joints])
            grippers = columns[ACTION][:, -len(self.tools) :]
            values = np.zeros((len(state), len(self.channels)))
            values[:, self._known.joint_slice] = np.concatenate([velocities[1:], velocities[-1:]])
        pose = self.pose(state)
        for pair in self._pairs:
            values[:, pair] = pose.turned(values[:, pair])
        rows = columns[MASK][:, : len(self.channels)].astype(bool)
        flags = [(rows == mask).all(axis=1) for mask in self.masks] if len(self.masks) > 1 else []
        return np.column_stack([values[:, self._commanded], *flags, grippers]).astype(np.float32)

    def decode(self, action: FloatArray, state: FloatArray) -> Intent:
        """Return what an action (a,) asks for, on the likeliest mask, in an observed state (s,)."""
        action, state = np.asarray(action, float), np.asarray(state, float)[None]
        pose = self.pose(state)
        values, count = np.zeros((1, len(self.channels))), len(self._commanded)
        values[0, self._commanded] = action[:count]
        for pair in self._pairs:
            values[:, pair] = pose.turned_back(values[:, pair])
        flags, grippers = np.split(action[count:], [-len(self.tools)])
        mask = np.array(self._sets[int(np.argmax(flags)) if len(flags) else 0], dtype=bool)
        return Intent(values[0], mask, tuple(map(decided_gripper, grippers.tolist())))

    def asked(self, action: FloatArray, state: FloatArray) -> FloatArray:
        """Return the values of the channels that an action (a,) asks for, the focus (1 base), the grippers.

        The focus is there where the operator owned several sets of channels; NaN stays, and brakes the robot.
        """
        intent = self.decode(action, state)
        focus = [float(intent.mask[0])] if len(self.masks) > 1 else []
        return np.array([*intent.values[self._commanded], *focus, *intent.grippers])

    @cached_property
    def _known(self) -> Channels:
        return Channels.named(self.channels)

    @cached_property
    def _joints(self) -> tuple[str, ...]:
        return tuple(name.removeprefix("joint.") for name in self._known.joints)

    @cached_property
    def tools(self) -> tuple[str, ...]:
        """Names of the hands' tools, as recorded."""
        return tuple(name.removesuffix("gripper") + "tool" for name in self._known.grippers)

    @property
    def _needed(self) -> tuple[str, ...]:
        tools = (f"{tool}.{part}" for tool in self.tools for part in POSE)
        return (*tools, *(f"{joint}.{kind}" for joint in self._joints for kind in ("pos", "vel")))

    @property
    def _shows_base(self) -> bool:
        return self.base_pose and bool(self._known.base)

    @cached_property
    def _own(self) -> tuple[str, ...]:
        """The arms' joints, and numbers of the state that are neither a joint's nor a tool's."""
        arm = self._joints[3:] if self._known.base else self._joints
        others = (name for name in self.state_names if name not in self._needed)
        return (*(f"{joint}.pos" for joint in arm), *others)

    @cached_property
    def objects(self) -> list[tuple[str, tuple[str, ...], int]]:
        """Neighbouring numbers of the environment whose names begin alike: name, parts, where they begin."""
        found: list[tuple[str, tuple[str, ...], int]] = []
        start = 0
        for name, group in groupby(self.environment_names, key=lambda each: each.rpartition(".")[0]):
            parts = tuple(each.rpartition(".")[2] for each in group)
            found.append((name, parts, start))
            start += len(parts)
        return found

    def pose(self, state: FloatArray, hand: int = 0) -> RobotPose:
        """Return where the robot is, and the tool of one hand, from recorded states, (T, s)."""
        state = np.asarray(state, float)
        base = np.zeros((len(state), 3))
        if self._known.base:
            base = self._of(state, [f"{joint}.pos" for joint in self._joints[:3]])
        tool = self._of(state, [f"{self.tools[hand]}.{part}" for part in POSE])
        return RobotPose(base, tool[:, :3], rotations(tool[:, 3:]))

    def _of(self, state: FloatArray, names: Sequence[str]) -> FloatArray:
        return state[:, [self.state_names.index(name) for name in names]]

    @cached_property
    def _sets(self) -> tuple[tuple[bool, ...], ...]:
        """Every set of channels that is commanded."""
        return self.masks or (tuple(self._known.mask("joint").tolist()),)

    @cached_property
    def _commanded(self) -> list[int]:
        """The channels that it writes, by index."""
        return np.flatnonzero(np.any(self._sets, axis=0)).tolist()

    @cached_property
    def _pairs(self) -> list[list[int]]:
        """(x, y) pairs of velocities along the world's axes; one that a mask splits stays so."""
        known = self._known
        twists = [known.hand_slice(hand).start for hand in range(len(known.hands))]
        twists += [known.pair_slice.start] if known.pair else []
        starts = [first for twist in twists for first in (twist, twist + 3)]
        starts += [known.joint_slice.start] if known.base else []
        return [[s, s + 1] for s in starts if all(mask[s] == mask[s + 1] for mask in self._sets)]


def _names(features: Mapping[str, Feature], key: str) -> tuple[str, ...]:
    feature = features.get(key)
    if feature is None or feature.names is None:
        found = "none" if feature is None else "one without names"
        raise HandrailError(f"dataset: expected a column {key!r} with named entries, got {found}")
    return feature.names

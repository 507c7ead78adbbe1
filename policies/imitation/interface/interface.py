"""What a policy reads and writes, and how both come from and go to what Handrail records."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.datasets.format.schema import Feature
from handrail.policies.imitation.interface.actions import (
    Actions,
    Columns,
    IntentActions,
    Mask,
    RealisedActions,
    masks_of,
)
from handrail.policies.imitation.interface.relative import RelativeView

ACTIONS = ("realised", "intent")
COLUMNS = ("observation.state", "observation.environment_state", "action", "teleop.values", "teleop.mask")
_GRIPPER = "gripper"


@dataclass(frozen=True)
class PolicyInterface:
    """Between what is recorded and what a policy reads and writes; saved beside every checkpoint.

    Attributes:
        actions: `realised`, the joint velocities that came about, or `intent`, the operator's own command.
        state_names: of `observation.state` as recorded, (s,).
        environment_names: of `observation.environment_state` as recorded, (e,).
        channels: names of the command channels as recorded, (m,).
        masks: the sets of channels that the operator owned, (m,) each; none for `realised`.
    """

    actions: str
    state_names: tuple[str, ...]
    environment_names: tuple[str, ...]
    channels: tuple[str, ...]
    masks: tuple[Mask, ...] = ()

    @classmethod
    def of_dataset(
        cls, features: Mapping[str, Feature], episodes: Sequence[Columns], actions: str
    ) -> "PolicyInterface":
        """Return the interface of a policy that is trained on some episodes.

        Args:
            features: of the dataset.
            episodes: `COLUMNS` of each.
            actions: `realised` or `intent`.

        Raises:
            HandrailError: no such action space, or a dataset that does not say what is needed.
        """
        if actions not in ACTIONS:
            raise unknown_name("action space", actions, ACTIONS)
        state, environment, asked = (
            _names(features, key)
            for key in ("observation.state", "observation.environment_state", "teleop.values")
        )
        names = tuple(name for name in asked if name != _GRIPPER)
        masks = masks_of(_channels(names), episodes) if actions == "intent" else ()
        return cls(actions, state, environment, names, masks)

    @property
    def observation_names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Names of what the policy reads: state, environment."""
        return self._view.names

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of what the policy writes, (a,)."""
        return self._space.names

    def observe(self, state: FloatArray, environment: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what the policy reads, ([T,] s') and ([T,] e') float32, of what is recorded."""
        if state.ndim == 1:
            seen = self._view(state[None], environment[None])
            return seen[0][0], seen[1][0]
        return self._view(state, environment)

    def encode(self, columns: Columns) -> FloatArray:
        """Return the actions of a recorded episode, (T, a) float32, from its `COLUMNS`."""
        return self._space.encode(columns).astype(np.float32)

    def decode(self, action: FloatArray, state: FloatArray) -> Intent:
        """Return what an action (a,) asks for in an observed state (s,)."""
        pose = self._view.pose(np.asarray(state, float)[None])
        return self._space.decode(np.asarray(action, float), pose)

    def to_dict(self) -> dict[str, Any]:
        """Return the interface as JSON has it."""
        return asdict(self)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> "PolicyInterface":
        """Return the interface that JSON describes.

        Raises:
            HandrailError: it describes none.
        """
        names = [field.name for field in fields(cls)]
        found = content if isinstance(content, Mapping) and set(content) == set(names) else {}
        size = len(found["channels"]) if found and _texts(found["channels"]) else 0
        if not (
            size
            and _texts(found["state_names"])
            and _texts(found["environment_names"])
            and _masks(found["masks"], size)
        ):
            raise HandrailError(f"policy interface: expected {', '.join(names)}, got {content!r:.200}")
        if found["actions"] not in ACTIONS:
            raise unknown_name("action space", found["actions"], ACTIONS)
        if found["actions"] == "intent" and not found["masks"]:
            raise HandrailError("policy interface: expected masks of an intent, got none")
        state, environment, channels = (
            tuple(found[name]) for name in ("state_names", "environment_names", "channels")
        )
        return cls(found["actions"], state, environment, channels, tuple(map(tuple, found["masks"])))

    @cached_property
    def _view(self) -> RelativeView:
        channels = _channels(self.channels)
        joints = tuple(name.removeprefix("joint.") for name in channels.joints)
        return RelativeView(self.state_names, self.environment_names, joints, bool(channels.base))

    @cached_property
    def _space(self) -> Actions:
        channels = _channels(self.channels)
        if self.actions == "intent":
            return IntentActions(self._view, channels, self.masks)
        return RealisedActions(self._view, channels)


def _channels(names: Sequence[str]) -> Channels:
    """Return the channels that have these names."""

    def part(prefix: str) -> tuple[str, ...]:
        return tuple(name for name in names if name.startswith(prefix))

    return Channels(part("base."), part("ee."), part("joint."))


def _names(features: Mapping[str, Feature], key: str) -> tuple[str, ...]:
    feature = features.get(key)
    if feature is None or feature.names is None:
        raise HandrailError(
            f"dataset: expected a column {key!r} with named entries, as handrail-record writes it,"
            f" got {'none' if feature is None else 'one without names'}"
        )
    return feature.names


def _texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(each, str) for each in value)


def _masks(value: Any, size: int) -> bool:
    return isinstance(value, list) and all(
        isinstance(mask, list) and len(mask) == size and all(isinstance(each, bool) for each in mask)
        for mask in value
    )

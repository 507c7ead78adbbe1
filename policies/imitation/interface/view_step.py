"""What a policy sees, as a step of LeRobot's preprocessor; the steps that act find it, and what it saw."""

import json
import weakref
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from lerobot.configs import FeatureType, PipelineFeatureType, PolicyFeature
from lerobot.lerobot_types import EnvTransition, TransitionKey
from lerobot.processor import ProcessorStep, ProcessorStepRegistry

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.interface.interface import ENVIRONMENT, STATE, PolicyInterface

VIEW = "handrail_policy_view"
Features = dict[PipelineFeatureType, dict[str, PolicyFeature]]
_made: "weakref.WeakValueDictionary[str, PolicyViewStep]" = weakref.WeakValueDictionary()


@ProcessorStepRegistry.register(VIEW)
@dataclass(eq=False)
class PolicyViewStep(ProcessorStep):
    """Shows a policy what is recorded as it learnt to see it: relative poses, no velocities of its own.

    Attributes:
        interface: a `PolicyInterface`, as JSON.
        raw: the observation that was seen last, before it was changed.
        state: as recorded, of that moment, (B, s); None before any.

    Raises:
        HandrailError: the interface is none.
    """

    interface: dict[str, Any]
    raw: Mapping[str, Any] = field(default_factory=dict, init=False, repr=False)
    state: FloatArray | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        """Read the interface, and let the step that acts find this one."""
        self.seen = PolicyInterface.from_dict(self.interface)
        _made[_key(self.interface)] = self

    def __call__(self, transition: EnvTransition) -> EnvTransition:
        """Return what the policy reads.

        Raises:
            HandrailError: the observation is not what is recorded.
        """
        observation = dict(transition.get(TransitionKey.OBSERVATION) or {})
        sizes = len(self.seen.state_names), len(self.seen.environment_names)
        state = _numbers(observation, STATE, sizes[0])
        environment = _numbers(observation, ENVIRONMENT, sizes[1]) if sizes[1] else np.zeros((len(state), 0))
        seen = self.seen.observe(state, environment)
        for key, values in zip((STATE, ENVIRONMENT), seen, strict=True):
            like = observation.pop(key, observation.get(STATE))
            if values.shape[1]:
                observation[key] = torch.as_tensor(values, device=getattr(like, "device", None))
        self.raw, self.state = dict(transition.get(TransitionKey.OBSERVATION) or {}), state
        changed: Any = transition.copy()
        changed[TransitionKey.OBSERVATION] = observation
        return changed

    def get_config(self) -> dict[str, Any]:
        """Return what makes this step again."""
        return {"interface": self.interface}

    def reset(self) -> None:
        """Forget what was seen."""
        self.raw, self.state = {}, None

    def transform_features(self, features: Features) -> Features:
        """Return the features that the policy reads."""
        sizes = map(len, self.seen.observation_names)
        kinds = (FeatureType.STATE, FeatureType.ENV)
        shown = {
            key: PolicyFeature(kind, (size,))
            for key, kind, size in zip((STATE, ENVIRONMENT), kinds, sizes, strict=True)
        }
        before = features.get(PipelineFeatureType.OBSERVATION, {})
        return features | {PipelineFeatureType.OBSERVATION: before | shown}


def seen_by(interface: Mapping[str, Any]) -> Any:
    """Return the step that sees for an interface, of the preprocessor loaded last; None if there is none."""
    return _made.get(_key(interface))


def policy_rows(
    step: str, transition: EnvTransition, view: Any, seen: PolicyInterface
) -> tuple[FloatArray, FloatArray]:
    """Return what a policy writes, (B, a), and the states in which it does, (B, s).

    Args:
        step: the name of who asks, for the error.
        transition: with the policy's action.
        view: the step that sees.
        seen: what the policy reads and writes.

    Raises:
        HandrailError: nothing was seen before, or the action is not the policy's.
    """
    if view is None or view.state is None:
        raise HandrailError(
            f"step {step}: expected the step {VIEW} to see something first, in the preprocessor"
        )
    action, size = transition.get(TransitionKey.ACTION), len(seen.action_names)
    if not isinstance(action, torch.Tensor) or action.shape[-1] != size:
        raise HandrailError(f"step {step}: expected {size} numbers, got {getattr(action, 'shape', action)}")
    rows = action.detach().cpu().numpy().reshape(-1, size)
    return rows, np.broadcast_to(view.state, (len(rows), view.state.shape[1]))


def _key(interface: Mapping[str, Any]) -> str:
    return json.dumps(interface, sort_keys=True)


def _numbers(observation: Mapping[str, Any], key: str, size: int) -> FloatArray:
    """Return the numbers under a key, (B, size)."""
    values = observation.get(key)
    if not isinstance(values, torch.Tensor) or values.shape[-1] != size:
        raise HandrailError(
            f"step {VIEW}: expected {key} with {size} numbers, as handrail-record writes it,"
            f" got {'none' if values is None else list(getattr(values, 'shape', ()))}"
        )
    return values.detach().cpu().numpy().reshape(-1, size)

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

    A robot of LeRobot's, such as `handrail_sim`, shows robot and scene as one vector, `observation.state`.

    Attributes:
        interface: a `PolicyInterface`, as JSON.
        raw: the observation that was seen last, before it was changed.
        state: as recorded, of that moment, (B, s); None before any.
    """

    interface: dict[str, Any]
    raw: Mapping[str, Any] = field(default_factory=dict, init=False, repr=False)
    state: FloatArray | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        """Read the interface, and let the step that acts find this one."""
        self.seen = PolicyInterface.from_dict(self.interface)
        _made[_key(self.interface)] = self

    def __call__(self, transition: EnvTransition) -> EnvTransition:
        """Return what the policy reads."""
        observation = dict(transition.get(TransitionKey.OBSERVATION) or {})
        sizes = len(self.seen.state_names), len(self.seen.environment_names)
        if ENVIRONMENT not in observation and _size(observation.get(STATE)) == sum(sizes):
            observation |= {
                STATE: observation[STATE][..., : sizes[0]],
                ENVIRONMENT: observation[STATE][..., sizes[0] :],
            }
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


def asked(step: str, transition: EnvTransition, view: Any, seen: PolicyInterface) -> EnvTransition:
    """Return a transition in which the action is what a policy asks for, on channels, float64.

    Args:
        step: the name of who asks, for the error.
        transition: with the policy's action.
        view: the step that sees.
        seen: what the policy reads and writes.
    """
    rows, states = policy_rows(step, transition, view, seen)
    numbers = np.stack([seen.asked(row, state) for row, state in zip(rows, states, strict=True)])
    _check_taken(step, numbers.shape[1])
    changed: Any = transition.copy()
    shape = changed[TransitionKey.ACTION].shape[:-1]
    changed[TransitionKey.ACTION] = torch.as_tensor(numbers).reshape(*shape, numbers.shape[1])
    return changed


def _check_taken(step: str, size: int) -> None:
    """Refuse what `lerobot-rollout` would not: of too many numbers it takes the first, whatever they mean."""
    from handrail.collect.lerobot.sim import newest_robot

    robot = newest_robot()
    if robot and robot.is_connected and len(names := robot.action.names) != size:
        raise HandrailError(
            f"step {step}: the policy writes {size} numbers; --robot.mode={robot.mode.name} takes"
            f" {len(names)}: {', '.join(names)}; expected direct for joint velocities, for intents the mode"
            " of their demonstrations"
        )


def _key(interface: Mapping[str, Any]) -> str:
    return json.dumps(interface, sort_keys=True)


def _numbers(observation: Mapping[str, Any], key: str, size: int) -> FloatArray:
    """Return the numbers under a key, (B, size)."""
    values = observation.get(key)
    if not isinstance(values, torch.Tensor) or _size(values) != size:
        raise HandrailError(
            f"step {VIEW}: expected {key} with {size} numbers, as handrail-record writes it,"
            f" got {'none' if values is None else list(getattr(values, 'shape', ()))}"
        )
    return values.detach().cpu().numpy().reshape(-1, size)


def _size(values: Any) -> int:
    return values.shape[-1] if isinstance(values, torch.Tensor) and values.ndim else 0

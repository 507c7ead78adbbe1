"""The view of a policy as steps of LeRobot's processors, inside its checkpoint: who loads it needs no more.

```
recorded columns ─ view ─▶ normalise ─▶ policy ─▶ unnormalise ─ act ─▶ joint velocities, or a mode's channels
                     └──────────── the robot's pose now ─────────┘
```
"""

import json
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
import torch
from lerobot.configs import FeatureType, PipelineFeatureType, PolicyFeature
from lerobot.lerobot_types import EnvTransition, TransitionKey
from lerobot.processor import ProcessorStep, ProcessorStepRegistry
from lerobot.processor.normalize_processor import NormalizerProcessorStep

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.interface.interface import ACTION, ENVIRONMENT, STATE, PolicyInterface

VIEW, ACT = "handrail_policy_view", "handrail_policy_action"
Features = dict[PipelineFeatureType, dict[str, PolicyFeature]]
_made: "weakref.WeakValueDictionary[str, PolicyViewStep]" = weakref.WeakValueDictionary()


@ProcessorStepRegistry.register(VIEW)
@dataclass(eq=False)
class PolicyViewStep(ProcessorStep):
    """Shows a policy what is recorded as it learnt to see it: relative poses, no velocities of its own.

    Attributes:
        interface: a `PolicyInterface`, as JSON.
        state: as recorded, of the moment that was seen last, (B, s); None before any.

    Raises:
        HandrailError: the interface is none.
    """

    interface: dict[str, Any]
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
        self.state = state
        changed: Any = transition.copy()
        changed[TransitionKey.OBSERVATION] = observation
        return changed

    def get_config(self) -> dict[str, Any]:
        """Return what makes this step again."""
        return {"interface": self.interface}

    def reset(self) -> None:
        """Forget what was seen."""
        self.state = None

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


@ProcessorStepRegistry.register(ACT)
@dataclass(eq=False)
class PolicyActionStep(ProcessorStep):
    """Turns what a policy writes, in the base's axes, into an action in those of the world.

    Joint velocities and the gripper; or the channels of a teleop mode, the focus (1 base) where it has two,
    and the gripper: the action of `lerobot-eval --env.mode`.

    Attributes:
        interface: a `PolicyInterface`, as JSON.

    Raises:
        HandrailError: the interface is none.
    """

    interface: dict[str, Any]

    def __post_init__(self) -> None:
        """Read the interface, and find the step that sees: that of the preprocessor loaded just before."""
        self.seen = PolicyInterface.from_dict(self.interface)
        self.view = _made.get(_key(self.interface))

    def __call__(self, transition: EnvTransition) -> EnvTransition:
        """Return the action.

        Raises:
            HandrailError: nothing was seen before, or the action is not the policy's.
        """
        if self.view is None or self.view.state is None:
            raise HandrailError(
                f"step {ACT}: expected the step {VIEW} to see something first, in the preprocessor"
            )
        action = transition.get(TransitionKey.ACTION)
        size = len(self.seen.action_names)
        if not isinstance(action, torch.Tensor) or action.shape[-1] != size:
            raise HandrailError(
                f"step {ACT}: expected {size} numbers, got {getattr(action, 'shape', action)}"
            )
        rows = action.detach().cpu().numpy().reshape(-1, size)
        states = np.broadcast_to(self.view.state, (len(rows), self.view.state.shape[1]))
        meant = np.stack([self._meant(row, state) for row, state in zip(rows, states, strict=True)])
        changed: Any = transition.copy()
        changed[TransitionKey.ACTION] = torch.as_tensor(meant).reshape(*action.shape[:-1], meant.shape[1])
        return changed

    def _meant(self, row: FloatArray, state: FloatArray) -> FloatArray:
        """Return the numbers of an action, float64: nothing is lost; NaN stays, and brakes the robot."""
        intent = self.seen.decode(row, state)
        values = intent.values[self.seen.commanded]
        focus = [float(intent.mask[0])] if len(self.seen.masks) > 1 else []
        return np.array([*values, *focus, intent.gripper])

    def get_config(self) -> dict[str, Any]:
        """Return what makes this step again."""
        return {"interface": self.interface}

    def transform_features(self, features: Features) -> Features:
        """Return the feature of the action."""
        size = len(self.seen.commanded) + (len(self.seen.masks) > 1) + 1
        return features | {PipelineFeatureType.ACTION: {ACTION: PolicyFeature(FeatureType.ACTION, (size,))}}


def with_steps(before: Any, after: Any, interface: PolicyInterface | None) -> tuple[Any, Any]:
    """Return a policy's processors with the steps of its interface, so that anybody can run the policy.

    Args:
        before: LeRobot's preprocessor.
        after: LeRobot's postprocessor.
        interface: what the policy reads and writes; None if that is what was recorded.
    """
    if interface is None:
        return before, after
    described = json.loads(json.dumps(asdict(interface)))
    view, steps = PolicyViewStep(described), list(before.steps)
    normalisers = [i for i, step in enumerate(steps) if isinstance(step, NormalizerProcessorStep)]
    steps.insert(normalisers[0] if normalisers else len(steps), view)
    acts = [*after.steps, PolicyActionStep(described)]
    return replace(before, steps=steps), replace(after, steps=acts)


def without_steps(pipeline: Any) -> Any:
    """Return a processor without the steps of an interface, for who sees and acts through that itself."""
    return replace(pipeline, steps=[step for step in pipeline.steps if not isinstance(step, _OURS)])


def interface_in(pipeline: Any) -> PolicyInterface | None:
    """Return the interface that a processor's steps have; None if it has none of them."""
    steps: Sequence[Any] = pipeline.steps
    return next((step.seen for step in steps if isinstance(step, _OURS)), None)


_OURS = (PolicyViewStep, PolicyActionStep)


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

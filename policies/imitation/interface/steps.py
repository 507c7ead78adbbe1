"""The view of a policy as steps of LeRobot's processors, inside its checkpoint: who loads it needs no more.

```
recorded columns ─ view ─▶ normalise ─▶ policy ─▶ unnormalise ─ act ─▶ joint velocities, or a mode's channels
                     └──────────── the robot's pose now ─────────┘ or complete: joint velocities of an intent
```
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
import torch
from lerobot.configs import PipelineFeatureType, PolicyFeature
from lerobot.lerobot_types import EnvTransition, TransitionKey
from lerobot.processor import ProcessorStep, ProcessorStepRegistry
from lerobot.processor.normalize_processor import NormalizerProcessorStep

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import decoded
from handrail.policies.imitation.interface.completion import CompletedRobot, Completion
from handrail.policies.imitation.interface.interface import ENVIRONMENT, STATE, PolicyInterface
from handrail.policies.imitation.interface.trust import ACT, COMPLETE, VIEW

AROUND = tuple(f"observation.{name}" for name in ("time", "sent", "obstacles"))
Features = dict[PipelineFeatureType, dict[str, PolicyFeature]]
_views: "WeakValueDictionary[PolicyInterface, PolicyViewStep]" = WeakValueDictionary()
"""The step that sees, of the preprocessor loaded last: LeRobot loads those that act apart from it."""


@dataclass(eq=False)
class PolicyStep(ProcessorStep):
    """A step of our own."""

    interface: dict[str, Any]
    """A `PolicyInterface`, as JSON."""

    def __post_init__(self) -> None:
        """Read the interface."""
        self.seen = decoded(self.interface, PolicyInterface, "policy interface")

    def get_config(self) -> dict[str, Any]:
        """Return what makes this step again."""
        return {"interface": self.interface}

    def transform_features(self, features: Features) -> Features:
        """Return the features as they are: LeRobot asks the steps of robots for theirs, never a policy's."""
        return features


@ProcessorStepRegistry.register(VIEW)
@dataclass(eq=False)
class PolicyViewStep(PolicyStep):
    """Shows a policy what is recorded as it learnt to see it: relative poses, no velocities of its own.

    A robot of LeRobot's, such as `handrail_sim`, shows robot and scene as one vector, `observation.state`.
    """

    raw: Mapping[str, Any] = field(default_factory=dict, init=False, repr=False)
    """The observation that was seen last, before it was changed."""
    state: FloatArray | None = field(default=None, init=False, repr=False)
    """As recorded, of that moment, (B, s); None before any."""

    def __post_init__(self) -> None:
        """Let the step that acts find this one."""
        super().__post_init__()
        _views[self.seen] = self

    def __call__(self, transition: EnvTransition) -> EnvTransition:
        """Return what the policy reads."""
        raw = dict(transition.get(TransitionKey.OBSERVATION) or {})
        seen, sizes = dict(raw), (len(self.seen.state_names), len(self.seen.environment_names))
        if ENVIRONMENT not in seen and _size(seen.get(STATE)) == sum(sizes):
            both = seen[STATE]
            seen |= {STATE: both[..., : sizes[0]], ENVIRONMENT: both[..., sizes[0] :]}
        state = _numbers(seen, STATE, sizes[0])
        around = _numbers(seen, ENVIRONMENT, sizes[1]) if sizes[1] else np.zeros((len(state), 0))
        shown = self.seen.observe(state, around)
        for key, values in zip((STATE, ENVIRONMENT), shown, strict=True):
            like = seen.pop(key, seen.get(STATE))
            if values.shape[1]:
                seen[key] = torch.as_tensor(values, device=getattr(like, "device", None))
        self.raw, self.state = raw, state
        changed: Any = transition.copy()
        changed[TransitionKey.OBSERVATION] = seen
        return changed

    def reset(self) -> None:
        """Forget what was seen."""
        self.raw, self.state = {}, None


@ProcessorStepRegistry.register(ACT)
@dataclass(eq=False)
class PolicyActionStep(PolicyStep):
    """Turns what a policy writes, in the base's axes, into an action in those of the world.

    Joint velocities and the gripper; or the channels of a teleop mode, the focus (1 base) where it has two,
    and the gripper: the action of `lerobot-eval --env.mode`.
    """

    def __post_init__(self) -> None:
        """Find the step that sees: that of the preprocessor loaded just before."""
        super().__post_init__()
        self.view = _views.get(self.seen)

    def __call__(self, transition: EnvTransition) -> EnvTransition:
        """Return the action."""
        rows, states = self._rows(transition)
        numbers = [self.seen.asked(row, state) for row, state in zip(rows, states, strict=True)]
        self._check_taken(len(numbers[0]))
        return _acting(transition, numbers)

    def _rows(self, transition: EnvTransition) -> tuple[FloatArray, FloatArray]:
        """Return what the policy writes, (B, a), and the states in which it does, (B, s)."""
        if self.view is None or self.view.state is None:
            raise self._error(f"expected the step {VIEW} to see something first, in the preprocessor")
        action, size = transition.get(TransitionKey.ACTION), len(self.seen.action_names)
        if not isinstance(action, torch.Tensor) or _size(action) != size:
            raise self._error(f"expected {size} numbers, got {getattr(action, 'shape', action)}")
        rows = action.detach().cpu().numpy().reshape(-1, size)
        return rows, np.broadcast_to(self.view.state, (len(rows), self.view.state.shape[1]))

    def _check_taken(self, size: int) -> None:
        """Refuse what `lerobot-rollout` would not: of too many numbers it takes the first of any meaning."""
        from handrail.collect.lerobot.sim import newest_robot

        robot = newest_robot()
        if robot and robot.is_connected and len(names := robot.action.names) != size:
            said = f"--robot.mode={robot.mode.name} takes {len(names)}: {', '.join(names)}"
            words = "direct for joint velocities, for intents the mode of their demonstrations"
            raise self._error(f"the policy writes {size} numbers; {said}; expected {words}")

    def _error(self, words: str) -> HandrailError:
        return HandrailError(f"step {getattr(self, '_registry_name', '')}: {words}")


@ProcessorStepRegistry.register(COMPLETE)
@dataclass(eq=False)
class PolicyCompletionStep(PolicyActionStep):
    """Turns the intents that a policy writes into joint velocities and gripper of the whole robot.

    It avoids what the environment `handrail` says stands around; an action that is not finite brakes. Where
    nothing is said of that, as by the robot `handrail_sim`, the robot completes the intents itself.
    """

    completion: dict[str, Any]
    """A `Completion`, as JSON."""
    _robots: list[CompletedRobot] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        """Read the settings."""
        super().__post_init__()
        self._by = decoded(self.completion, Completion, f"step {COMPLETE}")

    def __call__(self, transition: EnvTransition) -> EnvTransition:
        """Return the action."""
        if self.view is not None and self.view.raw.keys().isdisjoint(AROUND):
            return super().__call__(transition)
        rows, states = self._rows(transition)
        around = [self._around(key, len(rows)) for key in AROUND]
        self._robots += [CompletedRobot(self.seen, self._by) for _ in rows[len(self._robots) :]]
        parts = zip(self._robots, rows, states, *around, strict=False)
        return _acting(transition, [robot.velocities(*numbers) for robot, *numbers in parts])

    def get_config(self) -> dict[str, Any]:
        """Return what makes this step again."""
        return {"interface": self.interface, "completion": self.completion}

    def _around(self, key: str, count: int) -> FloatArray:
        values = self.view.raw.get(key) if self.view else None
        if not isinstance(values, torch.Tensor) or len(values) != count:
            words = f"{key} of {count} robots, as --env.type=handrail shows it"
            raise self._error(f"expected {words}; got {_shape(values)}")
        return values.detach().cpu().numpy().astype(np.float64)


def with_steps(
    before: Any, after: Any, interface: PolicyInterface | None, completion: Completion | None = None
) -> tuple[Any, Any]:
    """Return a policy's processors with the steps of its interface, so that anybody can run the policy.

    Args:
        before: LeRobot's preprocessor.
        after: LeRobot's postprocessor.
        interface: what the policy reads and writes; None if that is what was recorded.
        completion: what completes its intents, if it writes any and that can be found again.
    """
    if interface is None:
        return before, after
    described = json.loads(json.dumps(asdict(interface)))
    view, steps = PolicyViewStep(described), list(before.steps)
    normalisers = [i for i, step in enumerate(steps) if isinstance(step, NormalizerProcessorStep)]
    steps.insert(normalisers[0] if normalisers else len(steps), view)
    act = PolicyActionStep(described)
    if completion is not None and completion.is_installed and interface.is_partial:
        act = PolicyCompletionStep(described, asdict(completion))
    return replace(before, steps=steps), replace(after, steps=[*after.steps, act])


def without_steps(pipeline: Any) -> Any:
    """Return a processor without the steps of an interface, for who sees and acts through that itself."""
    return replace(pipeline, steps=[step for step in pipeline.steps if not isinstance(step, PolicyStep)])


def interface_in(pipeline: Any) -> PolicyInterface | None:
    """Return the interface that a processor's steps have; None if it has none of them."""
    return next((step.seen for step in pipeline.steps if isinstance(step, PolicyStep)), None)


def _acting(transition: EnvTransition, numbers: list[FloatArray]) -> EnvTransition:
    """Return a transition with another action, float64, of a batch or of one."""
    changed: Any = transition.copy()
    shape = changed[TransitionKey.ACTION].shape[:-1]
    changed[TransitionKey.ACTION] = torch.as_tensor(np.stack(numbers)).reshape(*shape, len(numbers[0]))
    return changed


def _numbers(observation: Mapping[str, Any], key: str, size: int) -> FloatArray:
    """Return the numbers under a key, (B, size)."""
    values = observation.get(key)
    if not isinstance(values, torch.Tensor) or _size(values) != size:
        words = f"expected {key} with {size} numbers, as recorded"
        raise HandrailError(f"step {VIEW}: {words}; got {_shape(values)}")
    return values.detach().cpu().numpy().reshape(-1, size)


def _size(values: Any) -> int:
    return values.shape[-1] if isinstance(values, torch.Tensor) and values.ndim else 0


def _shape(values: Any) -> object:
    return "none" if values is None else list(getattr(values, "shape", ()))

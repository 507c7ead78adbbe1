"""The view of a policy as steps of LeRobot's processors, inside its checkpoint: who loads it needs no more.

```
recorded columns ─ view ─▶ normalise ─▶ policy ─▶ unnormalise ─ act ─▶ joint velocities, or a mode's channels
                     └──────────── the robot's pose now ─────────┘ or complete (`completion.py`)
```
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from lerobot.configs import FeatureType, PipelineFeatureType, PolicyFeature
from lerobot.lerobot_types import EnvTransition
from lerobot.processor import ProcessorStep, ProcessorStepRegistry
from lerobot.processor.normalize_processor import NormalizerProcessorStep

from handrail.policies.imitation.interface.completion import COMPLETE, Completion, PolicyCompletionStep
from handrail.policies.imitation.interface.interface import ACTION, PolicyInterface
from handrail.policies.imitation.interface.view_step import (
    VIEW,
    Features,
    PolicyViewStep,
    asked,
    seen_by,
)

ACT = "handrail_policy_action"
NAMES = (VIEW, ACT, COMPLETE)


@ProcessorStepRegistry.register(ACT)
@dataclass(eq=False)
class PolicyActionStep(ProcessorStep):
    """Turns what a policy writes, in the base's axes, into an action in those of the world.

    Joint velocities and the gripper; or the channels of a teleop mode, the focus (1 base) where it has two,
    and the gripper: the action of `lerobot-eval --env.mode`.

    Attributes:
        interface: a `PolicyInterface`, as JSON.
    """

    interface: dict[str, Any]

    def __post_init__(self) -> None:
        """Read the interface, and find the step that sees: that of the preprocessor loaded just before."""
        self.seen = PolicyInterface.from_dict(self.interface)
        self.view = seen_by(self.interface)

    def __call__(self, transition: EnvTransition) -> EnvTransition:
        """Return the action."""
        return asked(ACT, transition, self.view, self.seen)

    def get_config(self) -> dict[str, Any]:
        """Return what makes this step again."""
        return {"interface": self.interface}

    def transform_features(self, features: Features) -> Features:
        """Return the feature of the action."""
        size = len(self.seen.commanded) + (len(self.seen.masks) > 1) + 1
        return features | {PipelineFeatureType.ACTION: {ACTION: PolicyFeature(FeatureType.ACTION, (size,))}}


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
    if completion is not None and completion.is_installed and interface.is_partial:
        act: ProcessorStep = PolicyCompletionStep(described, asdict(completion))
    else:
        act = PolicyActionStep(described)
    return replace(before, steps=steps), replace(after, steps=[*after.steps, act])


def without_steps(pipeline: Any) -> Any:
    """Return a processor without the steps of an interface, for who sees and acts through that itself."""
    return replace(pipeline, steps=[step for step in pipeline.steps if not isinstance(step, _OURS)])


def interface_in(pipeline: Any) -> PolicyInterface | None:
    """Return the interface that a processor's steps have; None if it has none of them."""
    steps: Sequence[Any] = pipeline.steps
    return next((step.seen for step in steps if isinstance(step, _OURS)), None)


_OURS = (PolicyViewStep, PolicyActionStep, PolicyCompletionStep)

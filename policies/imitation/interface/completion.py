"""A policy of intents completes them itself: its mode's controller is a step of its postprocessor.

```
policy ─▶ unnormalise ─ intent, in the base's axes ─▶ controller of the mode ─▶ joint velocities
preprocessor's view: the robot, what it was sent, what stands around, the time ─┘
```
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import torch
from lerobot.configs import FeatureType, PipelineFeatureType, PolicyFeature
from lerobot.lerobot_types import EnvTransition, TransitionKey
from lerobot.processor import ProcessorStep, ProcessorStepRegistry

from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_controller
from handrail.collect.world.observation import from_numbers
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.model import load_model
from handrail.controllers.typed import Name, decoded
from handrail.policies.imitation.interface.checkpoint import Fps
from handrail.policies.imitation.interface.interface import ACTION, PolicyInterface
from handrail.policies.imitation.interface.view_step import Features, asked, policy_rows, seen_by

COMPLETE = "handrail_policy_mpc"
TIME, SENT, OBSTACLES = (f"observation.{name}" for name in ("time", "sent", "obstacles"))


@dataclass(frozen=True)
class Completion:
    """What completes the intents of a policy."""

    robot: Name
    task: Name
    """The controller knows the objectives that it brings."""
    mode: Name
    """Teleop mode, whose controller it is."""
    fps: Fps
    """Intents a second [Hz]."""

    @property
    def is_installed(self) -> bool:
        """Whether all names are found again without importing what a file says."""
        named = ((ROBOTS, self.robot), (TASKS, self.task), (MODES, self.mode))
        return all(name in registry for registry, name in named)


@ProcessorStepRegistry.register(COMPLETE)
@dataclass(eq=False)
class PolicyCompletionStep(ProcessorStep):
    """Turns the intents that a policy writes into joint velocities and gripper of the whole robot.

    It avoids what the environment `handrail` says stands around; an action that is not finite brakes. Where
    nothing is said of that, as by the robot `handrail_sim`, the robot completes the intents itself.

    Attributes:
        interface: a `PolicyInterface`, as JSON.
        completion: a `Completion`, as JSON.
    """

    interface: dict[str, Any]
    completion: dict[str, Any]
    _bodies: list["_Body"] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        """Read the settings, and find the step that sees: that of the preprocessor loaded just before."""
        self.seen = PolicyInterface.from_dict(self.interface)
        self._by = decoded(self.completion, Completion, f"step {COMPLETE}")
        self.view = seen_by(self.interface)

    def __call__(self, transition: EnvTransition) -> EnvTransition:
        """Return the action."""
        if self.view is not None and not {TIME, SENT, OBSTACLES} & self.view.raw.keys():
            return asked(COMPLETE, transition, self.view, self.seen)
        rows, states = policy_rows(COMPLETE, transition, self.view, self.seen)
        assert self.view is not None
        around = [_shown(self.view.raw, key, len(rows)) for key in (TIME, SENT, OBSTACLES)]
        while len(self._bodies) < len(rows):
            self._bodies.append(_Body(self.seen, self._by))
        parts = zip(self._bodies, rows, states, *around, strict=False)
        meant = np.stack([body.completed(*numbers) for body, *numbers in parts])
        changed: Any = transition.copy()
        changed[TransitionKey.ACTION] = torch.as_tensor(meant)
        return changed

    def get_config(self) -> dict[str, Any]:
        """Return what makes this step again."""
        return {"interface": self.interface, "completion": self.completion}

    def transform_features(self, features: Features) -> Features:
        """Return the feature of the action."""
        size = sum(name.startswith("joint.") for name in self.seen.channels) + 1
        return features | {PipelineFeatureType.ACTION: {ACTION: PolicyFeature(FeatureType.ACTION, (size,))}}


class _Body:
    """One robot and its controller; an environment of several has as many."""

    def __init__(self, seen: PolicyInterface, by: Completion) -> None:
        for registry, name in ((ROBOTS, by.robot), (TASKS, by.task), (MODES, by.mode)):
            registry.admit(name)
        self._seen, self._mode, self._period = seen, by.mode, 1.0 / by.fps
        model = load_model(by.robot)
        if Channels.of(model.description).names != seen.channels:
            raise HandrailError(f"step {COMPLETE}: expected the channels of {by.robot}, got others")
        self._n = model.size
        self._controller = build_controller(MODES.find(by.mode), model, by.fps, by.task)
        self._time, self._around = np.inf, b""

    def completed(
        self, action: FloatArray, state: FloatArray, time: FloatArray, sent: FloatArray, around: FloatArray
    ) -> FloatArray:
        """Return velocities and gripper, (n + 1,); an episode begins where the time is not later."""
        now, n = float(time[0]), self._n
        if now <= self._time:
            self._controller.reset(from_numbers(around))
        elif around.tobytes() != self._around:
            self._controller.update_scene(from_numbers(around))
        self._time, self._around = now, around.tobytes()
        command = self._controller.update(
            State(state[:n], state[n : 2 * n], now, sent), self._intent(action, state, now)
        )
        return np.append(command.velocity(self._period), command.gripper)

    def _intent(self, action: FloatArray, state: FloatArray, now: float) -> Intent:
        if np.all(np.isfinite(action)):
            return replace(self._seen.decode(action, state), mode=self._mode, time=now)
        size = len(self._seen.channels)
        return Intent(np.full(size, np.nan), np.ones(size, bool), mode=self._mode, time=now)


def _shown(raw: Mapping[str, Any], key: str, count: int) -> FloatArray:
    values = raw.get(key)
    if not isinstance(values, torch.Tensor) or len(values) != count:
        raise HandrailError(
            f"step {COMPLETE}: expected {key} of {count} robots, as --env.type=handrail shows it;"
            f" got {'none' if values is None else list(getattr(values, 'shape', ()))}"
        )
    return values.detach().cpu().numpy().astype(np.float64)

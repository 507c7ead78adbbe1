"""The view of a policy as steps of LeRobot's processors, inside its checkpoint: who loads it needs no more.

```
recorded columns ─ view ─▶ normalise ─▶ policy ─▶ unnormalise ─ act ─▶ joint velocities, or a mode's channels
 ▲ encode            └──────────── the robot's pose now ─────────┘ or complete: joint velocities of an intent
pictures
```
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
import torch
from lerobot.processor import ActionProcessorStep, ObservationProcessorStep, ProcessorStepRegistry
from lerobot.processor.normalize_processor import NormalizerProcessorStep

from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_controller
from handrail.collect.world.observation import from_numbers
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.catalogue import CONTROLLERS
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.model import load_model
from handrail.controllers.typed import Name, decoded
from handrail.policies.imitation.interface.checkpoint import MIXED, Fps, as_json
from handrail.policies.imitation.interface.encoder import Encoder
from handrail.policies.imitation.interface.encoder_step import (
    OwnStep,
    apart,
    encoder_step,
    numbers_of,
    shape_of,
    size_of,
)
from handrail.policies.imitation.interface.interface import ENVIRONMENT, STATE, PolicyInterface
from handrail.policies.imitation.interface.trust import ACT, COMPLETE, VIEW

_UNEVEN = 0.01  # share of a period that one may be longer or shorter, beside what float32 rounds
AROUND = tuple(f"observation.{name}" for name in ("time", "sent", "obstacles"))
_views: "WeakValueDictionary[PolicyInterface, PolicyViewStep]" = WeakValueDictionary()
"""The step that sees, of the preprocessor loaded last: LeRobot loads those that act apart from it."""


@dataclass(frozen=True)
class Completion:
    """The completion of a policy's intents into the whole robot's motion: its mode's own controller."""

    robot: Name
    task: Name
    """The controller knows the objectives that it brings."""
    mode: Name
    fps: Fps
    """Intents a second [Hz]."""
    hand: Name = ""
    """Which of several hands does the task."""


class CompletedRobot:
    """One robot and its controller; an environment of several has as many.

    Args:
        interface: what the policy reads and writes.
        by: what completes that; a name that would be imported is refused.
    """

    def __init__(self, interface: PolicyInterface, by: Completion) -> None:
        for registry, name in ((ROBOTS, by.robot), (TASKS, by.task), (MODES, by.mode)):
            registry.admit(name)
        model = load_model(by.robot).with_hand(by.hand)
        if Channels.of(model.description).names != interface.channels:
            raise HandrailError(f"completion of intents: expected the channels of {by.robot}, got others")
        self._interface, self._by, self._n = interface, by, model.size
        self._tools = [hand.named("tool") for hand in model.description.hands]
        if CONTROLLERS.find(MODES.find(by.mode).controller).aims:
            words = "its controller needs the goal, which LeRobot shows it not; use handrail-evaluate"
            raise HandrailError(f"completion of intents in mode {by.mode}: {words}")
        self._controller = build_controller(MODES.find(by.mode), model, by.fps, by.task)
        self._time, self._around = np.inf, b""

    def velocities(
        self, action: FloatArray, state: FloatArray, time: FloatArray, sent: FloatArray, around: FloatArray
    ) -> FloatArray:
        """Return velocities and grippers, (n + h,); an episode begins where the time is not later.

        Args:
            action: of the policy, (a,); one that is not finite brakes.
            state: as recorded, (s,).
            time: of the episode, (1,) [s].
            sent: velocities that were sent last, (n,).
            around: the obstacles, as numbers.
        """
        now, n = float(time[0]), self._n
        uneven = _UNEVEN + 2.0 * float(np.spacing(np.float32(now))) * self._by.fps
        if now > self._time and abs((now - self._time) * self._by.fps - 1.0) > uneven:
            words = f"expected {self._by.fps} actions a second (--env.fps={self._by.fps})"
            raise HandrailError(f"{words}, as it was trained; got {1.0 / (now - self._time):.3g}")
        if now <= self._time:
            self._controller.reset(from_numbers(around, self._tools))
        elif around.tobytes() != self._around:
            self._controller.update_scene(from_numbers(around, self._tools))
        self._time, self._around = now, around.tobytes()
        intent = Intent(
            np.full(len(self._interface.channels), np.nan), np.ones(len(self._interface.channels), bool)
        )
        if np.all(np.isfinite(action)):
            intent = self._interface.decode(action, state)
        asked = replace(intent, mode=self._by.mode, time=now)
        command = self._controller.update(State(state[:n], state[n : 2 * n], now, sent), asked)
        return np.append(command.velocity(1.0 / self._by.fps), command.grippers)


@dataclass(eq=False)
class PolicyStep(OwnStep):
    """A step of our own."""

    interface: dict[str, Any]
    """A `PolicyInterface`, as JSON."""

    def __post_init__(self) -> None:
        """Read the interface."""
        self.seen = decoded(self.interface, PolicyInterface, "policy interface")


@ProcessorStepRegistry.register(VIEW)
class PolicyViewStep(ObservationProcessorStep, PolicyStep):
    """Shows a policy what is recorded as it learnt to see it: relative poses, no velocities of its own."""

    raw: Mapping[str, Any]
    """The observation that was seen last, before it was changed."""
    state: FloatArray | None
    """As recorded, of that moment, (B, s); None before any."""

    def __post_init__(self) -> None:
        """Let the step that acts find this one."""
        super().__post_init__()
        self.reset()
        _views[self.seen] = self

    def observation(self, observation: dict[str, Any]) -> dict[str, Any]:
        """Return what the policy reads."""
        shown, size = apart(observation, self.seen), len(self.seen.environment_names)
        state = numbers_of(shown, STATE, len(self.seen.state_names), VIEW)
        around = numbers_of(shown, ENVIRONMENT, size, VIEW) if size else np.zeros((len(state), 0))
        device = shown[STATE].device
        for key, values in zip((STATE, ENVIRONMENT), self.seen.observe(state, around), strict=True):
            shown.pop(key, None)
            if values.shape[1]:
                shown[key] = torch.as_tensor(values, device=device)
        self.raw, self.state = observation, state
        return shown

    def reset(self) -> None:
        """Forget what was seen."""
        self.raw, self.state = {}, None


@ProcessorStepRegistry.register(ACT)
class PolicyActionStep(ActionProcessorStep, PolicyStep):
    """Turns what a policy writes, in the base's axes, into an action in those of the world.

    Joint velocities and the grippers; or the channels of a teleop mode, the focus (1 base) where it has two,
    and the grippers: the action of `lerobot-eval --env.mode`.
    """

    def __post_init__(self) -> None:
        """Find the step that sees: that of the preprocessor loaded just before."""
        super().__post_init__()
        self.view = _views.get(self.seen)

    def action(self, action: Any) -> torch.Tensor:
        """Return the action."""
        if self.view is None or self.view.state is None:
            raise self._error(f"expected the step {VIEW} to see something first, in the preprocessor")
        size = len(self.seen.action_names)
        if not isinstance(action, torch.Tensor) or size_of(action) != size:
            raise self._error(f"expected {size} numbers, got {getattr(action, 'shape', action)}")
        rows = action.detach().cpu().numpy().reshape(-1, size)
        states = np.broadcast_to(self.view.state, (len(rows), self.view.state.shape[1]))
        acted = torch.as_tensor(np.stack(self._acted(rows, states, self.view.raw)))
        return acted.reshape(*action.shape[:-1], acted.shape[1])

    def _acted(self, rows: FloatArray, states: FloatArray, raw: Mapping[str, Any]) -> list[FloatArray]:
        """Return actions, of what a policy writes, (B, a), in some states, (B, s)."""
        numbers = [self.seen.asked(row, state) for row, state in zip(rows, states, strict=True)]
        self._check_taken(len(numbers[0]))
        return numbers

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

    def __post_init__(self) -> None:
        """Read the settings."""
        super().__post_init__()
        self._by = decoded(self.completion, Completion, f"step {COMPLETE}")
        self._robots: list[CompletedRobot] = []

    def _acted(self, rows: FloatArray, states: FloatArray, raw: Mapping[str, Any]) -> list[FloatArray]:
        if raw.keys().isdisjoint(AROUND):
            return super()._acted(rows, states, raw)
        for key in AROUND:
            if not isinstance(values := raw.get(key), torch.Tensor) or len(values) != len(rows):
                words = f"expected {key} of {len(rows)} robots, as --env.type=handrail shows it"
                raise self._error(f"{words}; got {shape_of(values)}")
        around = [raw[key].detach().cpu().numpy().astype(np.float64) for key in AROUND]
        self._robots += [CompletedRobot(self.seen, self._by) for _ in rows[len(self._robots) :]]
        parts = zip(self._robots, rows, states, *around, strict=False)
        return [robot.velocities(*numbers) for robot, *numbers in parts]


def with_steps(
    before: Any, after: Any, interface: PolicyInterface | None, by: Completion, encoder: Encoder | None = None
) -> tuple[Any, Any]:
    """Return a policy's processors with the steps of its interface, so that anybody can run the policy.

    Args:
        before: LeRobot's preprocessor.
        after: LeRobot's postprocessor.
        interface: what the policy reads and writes; None if that is what was recorded.
        by: what completes its intents, if all its names are found again without importing what a file says.
        encoder: reads for it from pictures where things are.
    """
    if interface is None:
        return before, after
    described = as_json(interface)
    view, steps = PolicyViewStep(described), list(before.steps)
    normalisers = [i for i, step in enumerate(steps) if isinstance(step, NormalizerProcessorStep)]
    first = normalisers[0] if normalisers else len(steps)
    steps[first:first] = [*([encoder_step(encoder)] if encoder else []), view]
    act = PolicyActionStep(described)
    known = by.robot in ROBOTS and by.task in TASKS and by.mode in MODES and by.hand != MIXED
    if interface.is_partial and known and not CONTROLLERS.find(MODES.find(by.mode).controller).aims:
        act = PolicyCompletionStep(described, {name: each for name, each in asdict(by).items() if each})
    return replace(before, steps=steps), replace(after, steps=[*after.steps, act])


def without_steps(pipeline: Any) -> Any:
    """Return a processor without our own steps, for who sees and acts through an interface itself."""
    return replace(pipeline, steps=[step for step in pipeline.steps if not isinstance(step, OwnStep)])

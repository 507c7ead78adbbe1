"""One episode, step by step: look, let the controller complete what is asked, move the robot.

```
look ─▶ view            whoever has the loop decides what is asked
step(intent) ─▶ controller ─ command ─▶ env.step ─▶ robot.send ─▶ frame
               (at its own rate)        at the robot's rate, along the command's trajectory
```
"""

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np

from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.session.outcome import Tally
from handrail.collect.world.env import HandrailEnv, Observation
from handrail.controllers.arrays import FloatArray, are_finite
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.command import Command, Status
from handrail.controllers.interface.controller import Controller
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.usual_frames import in_usual_frames
from handrail.controllers.robot.model import Pose
from handrail.datasets.recording.frames import Frame

ROUNDING = 1e-9  # of times [s]
_CREEP = 1e-3  # slower, a robot that brakes is sent rest [m/s, rad/s]


class Disturbance(Protocol):
    """Something from outside that acts on the robot: pushes."""

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note that an episode begins."""

    def act(self) -> None:
        """Act during the period that begins now."""


@runtime_checkable
class Aiming(Protocol):
    """A controller that takes where the hand is to be brought."""

    def aim(self, goal: Pose) -> None:
        """Say where, before an update."""


@dataclass
class Moment:
    """Everything that lasts from one step of an episode to the next."""

    observation: Observation
    """After the last step."""
    info: dict[str, Any]
    """Of the environment's last step."""
    tally: Tally
    view: View
    """The robot and its world at the last look."""
    holding: bool
    """Whether something was held when the controller was asked last."""
    command: Command = field(init=False)
    """Of the controller's last update."""
    asked: int = 0
    """Step of that update."""
    due: float = 0.0
    """Time of the next one [s]."""
    success: bool = False
    """Whether the task has succeeded in this episode."""
    terminated: bool = False
    """Whether the task or a person has ended it."""
    truncated: bool = False
    """Whether its time limit has."""
    looked: float = 0.0
    """Wall time of the last look since the episode began [s]."""

    @property
    def done(self) -> bool:
        """Whether the episode is over, at the latest by its time limit."""
        return self.terminated or self.truncated


class EpisodeLoop:
    """A robot in its world, a task and a controller: `begin` an episode, then `look` and `step`.

    The robot is sent a command every step of the environment; a controller that is asked less often says what
    to send in between.

    Args:
        env: a robot, its world and a task.
        controller: completes the intent.
        control_period: of the controller [s]; the robot's by default.
        disturbances: what acts on the robot from outside.
    """

    now: Moment  # where the episode that has begun stands

    def __init__(
        self,
        env: HandrailEnv,
        controller: Controller,
        control_period: float | None = None,
        disturbances: Sequence[Disturbance] = (),
    ) -> None:
        self.env, self._controller, self._disturbances = env, controller, disturbances
        self.control_period = control_period or env.period

    @property
    def tally(self) -> Tally:
        """The counts along the episode."""
        return self.now.tally

    @property
    def time(self) -> float:
        """Time since the episode began, on the robot's clock [s]."""
        return self.tally.frames * self.env.period

    @property
    def rests(self) -> bool:
        """Whether the robot was at rest at the last look, as it was told."""
        return not self.now.view.state.commanded.any()

    def begin(self, seed: int | None) -> View:
        """Begin an episode; the same seed begins the same one.

        Args:
            seed: of the environment.
        """
        observation, info = self.env.reset(seed=seed)
        self._controller.reset(self.env.plant.obstacles())
        tally = Tally(seed or 0, self.env.period)
        self.now = Moment(observation, info, tally, self._view(observation, info), self._holds)
        for disturbance in self._disturbances:
            disturbance.begin(self.env, seed or 0)
        return self.now.view

    def look(self) -> View:
        """Return the robot and its world as they are now; the next step acts on that."""
        self.now.looked = self.tally.elapsed
        self.now.view = self._view(self.now.observation, self.now.info)
        return self.now.view

    def step(self, intent: Intent, event: EpisodeEvent | None = None, counts: bool = True) -> Frame:
        """Move the robot for one of its periods; return what happened.

        Args:
            intent: what the operator asks for.
            event: what they say of the episode; a judgement makes this step the last.
            counts: whether the task judges this step.
        """
        env, now, tally, seen = self.env, self.now, self.now.tally, self.now.observation
        intent = intent.of_hands(len(env.model.description.hands))
        with tally.timed("controller"):
            action = self._action(intent)
            joints = action[: env.model.size]
            if event is EpisodeEvent.PAUSE and np.abs(joints).max() < _CREEP:
                joints[:] = 0.0  # a controller may come ever nearer to rest
        commanded = tally.elapsed
        with tally.timed("environment"):
            for disturbance in self._disturbances:
                disturbance.act()
            now.observation, _, terminated, truncated, now.info = env.step(action)
        tally.moved(now.info["contacts"])
        if counts:
            judged, says = event is not None and event.judges, event is EpisodeEvent.SUCCESS
            now.success |= says if judged and env.real else bool(now.info["is_success"])
            now.terminated |= terminated or judged
            now.truncated |= truncated
        return Frame(
            state=seen["agent_pos"],
            environment=seen["environment_state"],
            images=seen.get("pixels", {}),
            intent=in_usual_frames(intent, env.model, now.view.state.q, exactly=False) or intent,
            action=now.info["sent"],
            command=action.astype(np.float32),
            diagnostics=now.command.diagnostics,
            contacts=now.info["contacts"],
            success=now.success,
            done=now.done,
            wall_clock=now.looked,
            number=tally.frames - 1,
            undos=tally.undos,
            plan=now.command.plan or now.command,
            commanded=commanded,
        )

    def rest(self) -> None:
        """Stand still for a period that does not count; a simulation's time stands, a real robot is heard."""
        if self.env.real:
            self.now.observation, self.now.info = self.env.rest()

    def checkpoint(self) -> object:
        """Return where the episode stands, to come back to."""
        return self.env.checkpoint(), replace(self.now, tally=copy(self.tally))

    def restore(self, checkpoint: Any) -> None:
        """Come back to where the episode stood; the clock and what was spent go on."""
        world, then = checkpoint
        observation, info = self.env.restore(world)
        self._controller.reset(self.env.plant.obstacles())
        tally = self.tally.back_to(then.tally)
        self.now = replace(then, observation=observation, info=info, tally=tally, holding=self._holds)
        self.now.asked, self.now.due = tally.frames, self.time

    def _action(self, intent: Intent) -> FloatArray:
        """Return what to send now: the velocities at the end of the step, and grippers, (n + h,).

        The controller is asked if that is due; before, it is told what there is to avoid, if that can have
        changed: while things move or are held.
        """
        now, step = self.now, self.tally.frames
        if self.time >= now.due - ROUNDING:
            before, now.holding = now.holding, self._holds
            if self.env.start.scene.movers or now.holding or before:
                self._controller.update_scene(self.env.plant.obstacles())
            if isinstance(self._controller, Aiming) and (goal := self._goal):
                self._controller.aim(goal)
            now.command = self._checked(self._controller.update(now.view.state, intent))
            now.asked, now.due = step, now.due + self.control_period
            self.tally.updated(now.command)
        time = (step + 1 - now.asked) * self.env.period
        grippers = now.command.grippers
        if all(map(math.isnan, grippers)):  # nobody has asked yet
            grippers = now.info["sent"][self.env.model.size :]
        return np.concatenate((now.command.velocity(time), grippers))

    def _checked(self, command: Command) -> Command:
        """Return a controller's command, of the robot's size; a brake if a number of it is not finite."""
        n, hands = self.env.model.size, len(self.env.model.description.hands)
        wanted, found = f"a Command with {n} velocities and {hands} grippers", f"a {type(command).__name__}"
        if isinstance(command, Command):
            sizes = command.velocities.shape[1], len(command.grippers)
            found = f"a Command with {sizes[0]} velocities and {sizes[1]} grippers"
        if found != wanted:
            name = type(self._controller).__name__
            raise HandrailError(f"controller {name}: expected {wanted}, got {found}")
        valid = all(map(math.isfinite, command.grippers)) or all(map(math.isnan, command.grippers))
        if valid and math.isfinite(command.elapsed) and are_finite(command.velocities.ravel()):
            return command
        failed = replace(command.diagnostics, status=Status.SOLVER_FAILED)
        return Command(np.zeros((2, n)), self.control_period, 0.0, (math.nan,) * hands, failed)

    @property
    def _goal(self) -> Pose | None:
        """Where the hand is to be brought, if the task says that and somebody sees it."""
        state = self.now.view.task
        aim = None if self.env.real else self.env.task.aim(state)
        if aim is None:
            return None
        return Pose(aim.position, state.tool.rotation if aim.rotation is None else aim.rotation)

    @property
    def _holds(self) -> bool:
        return bool(self.env.plant.held())

    def _view(self, observation: Observation, info: Mapping[str, Any]) -> View:
        env = self.env
        seen = (env.state(), env.task_state()) if env.real else env.seen
        return View(*seen, observation, tuple(info["sent"][env.model.size :].tolist()))

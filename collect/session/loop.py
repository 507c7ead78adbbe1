"""One episode, step by step: look, let the controller complete what is asked, move the robot.

```
look ─▶ view            whoever has the loop decides what is asked
step(intent) ─▶ controller ─ command ─▶ env.step ─▶ robot.send ─▶ frame
               (at its own rate)        at the robot's rate, along the command's trajectory
```
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.session.outcome import Tally
from handrail.collect.world.env import HandrailEnv, Observation
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import Controller, State
from handrail.controllers.interface.intent import Intent
from handrail.datasets.recording.frames import Frame

ROUNDING = 1e-9  # of times [s]
_CREEP = 1e-3  # slower, a robot that brakes is sent rest [m/s, rad/s]


class Rate:
    """Says at which steps something is due that happens once a period.

    Args:
        period: [s].
        start: when it is due first [s].
    """

    def __init__(self, period: float, start: float = 0.0) -> None:
        self._period, self._next = period, start

    def due(self, time: float) -> bool:
        """Whether it is due at a step's time [s]."""
        return time >= self._next - ROUNDING

    def take(self) -> None:
        """Take note that it happens."""
        self._next += self._period


class Driver:
    """Drives the robot of one episode: a command is followed until the controller is asked again.

    It tells the controller what there is to avoid: at the beginning, and while it moves or is held.

    Args:
        controller: is reset.
        env: in which an episode has begun.
        period: of the controller [s].
        step: with which it begins.

    Attributes:
        command: of the controller's last update.
    """

    command: Command

    def __init__(self, controller: Controller, env: HandrailEnv, period: float, step: int = 0) -> None:
        self._controller, self._env, self._rate = controller, env, Rate(period, step * env.period)
        self._moving, self._holding = bool(env.start.scene.movers), bool(env.world.held())
        self._asked = step
        controller.reset(env.world.obstacles())

    def drive(self, step: int, state: State, intent: Intent) -> bool:
        """Ask the controller if it is due at a step; return whether it was."""
        if not self._rate.due(step * self._env.period):
            return False
        self._observe()
        self.command = self._controller.update(state, intent)
        self._asked = step
        self._rate.take()
        return True

    def action(self, step: int) -> FloatArray:
        """Return what to send for a step: the velocities at its end, and the gripper, (n + 1,)."""
        time = (step + 1 - self._asked) * self._env.period
        return np.append(self.command.velocity(time), self.command.gripper)

    def _observe(self) -> None:
        """Say where things are now, if that can have changed."""
        before, self._holding = self._holding, bool(self._env.world.held())
        if self._moving or self._holding or before:
            self._controller.update_scene(self._env.world.obstacles())


class Disturbance(Protocol):
    """Something from outside that acts on the robot: pushes."""

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note that an episode begins."""

    def act(self) -> None:
        """Act during the period that begins now."""


@dataclass
class Moment:
    """Everything that lasts from one step of an episode to the next.

    Attributes:
        observation: after the last step.
        info: of the environment's last step.
        driver: of the robot.
        tally: the counts along the episode.
        view: the robot and its world at the last look.
        success: whether the task has succeeded in this episode.
        terminated: whether the task or a person has ended it.
        truncated: whether its time limit has.
        looked: wall time of the last look since the episode began [s].
    """

    observation: Observation
    info: dict[str, Any]
    driver: Driver
    tally: Tally
    view: View
    success: bool = False
    terminated: bool = False
    truncated: bool = False
    looked: float = 0.0

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

    Attributes:
        now: where the episode that has begun stands.
    """

    now: Moment

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

    def begin(self, seed: int | None) -> View:
        """Begin an episode; the same seed begins the same one.

        Args:
            seed: of the environment.
        """
        observation, info = self.env.reset(seed=seed)
        driver = Driver(self._controller, self.env, self.control_period)
        tally = Tally(seed or 0, self.env.period)
        self.now = Moment(observation, info, driver, tally, self._view(observation))
        for disturbance in self._disturbances:
            disturbance.begin(self.env, seed or 0)
        return self.now.view

    def look(self) -> View:
        """Return the robot and its world as they are now; the next step acts on that."""
        self.now.looked = self.tally.elapsed
        self.now.view = self._view(self.now.observation)
        return self.now.view

    @property
    def rests(self) -> bool:
        """Whether the robot was at rest at the last look, as it was told."""
        commanded = self.now.view.state.commanded
        return commanded is not None and not commanded.any()

    def step(self, intent: Intent, event: EpisodeEvent | None = None, counts: bool = True) -> Frame:
        """Move the robot for one of its periods; return what happened.

        Args:
            intent: what the operator asks for.
            event: what they say of the episode; a judgement makes this step the last.
            counts: whether the task judges this step.
        """
        env, now, seen, wall_clock = self.env, self.now, self.now.observation, self.now.looked
        driver, tally = now.driver, now.tally
        with tally.timed("controller"):
            if driver.drive(tally.frames, now.view.state, intent):
                tally.updated(driver.command)
            action = driver.action(tally.frames)
            if event is EpisodeEvent.PAUSE and np.abs(action[:-1]).max() < _CREEP:
                action[:-1] = 0.0  # a controller may come ever nearer to rest
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
            intent=intent,
            action=now.info["sent"],
            command=action.astype(np.float32),
            diagnostics=driver.command.diagnostics,
            contacts=now.info["contacts"],
            success=now.success,
            done=now.done,
            wall_clock=wall_clock,
            number=tally.frames - 1,
            undos=tally.undos,
            plan=driver.command.plan or driver.command,
            commanded=commanded,
        )

    def checkpoint(self) -> object:
        """Return where the episode stands, to come back to."""
        return self.env.checkpoint(), replace(self.now, tally=copy(self.tally))

    def restore(self, checkpoint: Any) -> None:
        """Come back to where the episode stood; the clock and what was spent go on."""
        world, then = checkpoint
        observation, info = self.env.restore(world)
        tally = self.tally.back_to(then.tally)
        driver = Driver(self._controller, self.env, self.control_period, tally.frames)
        self.now = replace(then, observation=observation, info=info, driver=driver, tally=tally)

    def _view(self, observation: Observation) -> View:
        return View(self.env.robot.state(), self.env.task_state(), observation)

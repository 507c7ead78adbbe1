"""A session that somebody else's loop runs, one period at a time."""

import time
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from handrail.collect.commands.recording import episode_seed
from handrail.collect.config import SessionConfig
from handrail.collect.lerobot.mode_action import ModeAction
from handrail.collect.lerobot.names import lerobot_name
from handrail.collect.operators.human.steering import FOLLOW
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import View
from handrail.collect.seeds import evaluation_seed
from handrail.collect.session.build import build_controller, build_env, build_mode
from handrail.collect.session.driver import Driver
from handrail.collect.session.mode_controller import ModeController
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Diagnostics, Status
from handrail.controllers.interface.intent import Intent
from handrail.datasets.recording.frames import Frame, finite_distance

_CREEP = 1e-3  # slower, a robot that is held is sent rest [m/s, rad/s]
_TOWARD = MODES["joints"]  # the mode in which joints are led to positions
_LONG_AGO = -1e6  # when nobody who steers has asked last [s]
_STATUSES = tuple(Status)


class Stepwise:
    """A robot in its world, a task and a controller; who asks has the loop.

    Args:
        config: of the session.
        fps: periods a second [Hz].
        diagnostics: whether `numbers` says what was sent and how the controller fared.
        evaluation: whether the scenes are those of an evaluation; else of a recording.

    Attributes:
        config: of the session.
        env: a robot, its world and a task.
        mode: teleop mode.
        action: what is asked for every period.
        scene: number of the episode's beginning.
        episodes: how many have begun.
        view: what there is to see now.
        success: whether the task succeeded in this episode.
        done: whether it is over, as the task judges.
        frame: what happened in the last period; None before any.
        driven: whether an intent was completed in this episode.
        led: where the joints were led in the last period, (n,) [m, rad]; None if they were not.
    """

    view: View
    frame: Frame | None
    led: FloatArray | None

    def __init__(
        self, config: SessionConfig, fps: int, diagnostics: bool = True, evaluation: bool = False
    ) -> None:
        self.config, self.fps, self._told, self._evaluation = config, fps, diagnostics, evaluation
        self.env = build_env(config, fps)
        self.mode = build_mode(config, self.env.model)
        self._channels = Channels.of(self.env.model.description)
        self.action = ModeAction(self.mode, self._channels)
        build = partial(build_controller, model=self.env.model, fps=fps, task=config.task)
        modes = {mode.name: mode for mode in (_TOWARD, self.mode)}
        self._controller = ModeController(modes, build, self.mode)
        self._steps = self.brakes = self.episodes = 0
        self.scene, self.success, self.done, self.frame = -1, False, False, None

    def begin(self, scene: int) -> None:
        """Begin an episode in a scene, by its number: the same number, the same beginning."""
        self.scene, self._steps, self.brakes = scene, 0, 0
        self.episodes += 1
        self._started, self.frame = time.perf_counter(), None
        self._observation, self._info = self.env.reset(seed=self.seed)
        self._driver = Driver(self._controller, self.env, self.env.period)
        self._diagnostics = Diagnostics()
        self.success = self.done = self.driven = False
        self.led = None
        self._look()

    @property
    def seed(self) -> int:
        """Of the episode."""
        seed_of = evaluation_seed if self._evaluation else episode_seed
        return seed_of(self.config.seed, self.scene)

    def step(self, intent: Intent) -> None:
        """Let the controller complete an intent, and the robot move for a period."""
        self._move(intent)
        self.driven = True

    def hold(self) -> None:
        """Brake; once the robot rests, time stands still."""
        if np.any(self.view.state.commanded):
            nothing = Intent.idle(self._channels, _LONG_AGO)
            self._move(replace(nothing, gripper=self.gripper, mode=self.mode.name), stops=True)

    def lead(self, positions: FloatArray) -> None:
        """Lead the joints towards positions for a period, whatever the mode; that is no part of the task.

        Args:
            positions: (n,) [m, rad].
        """
        judged, fastest = (self.success, self.done), self.env.model.description.limits.velocity
        values, before = np.zeros(self._channels.size), positions if self.led is None else self.led
        toward = (positions - before) * self.fps + FOLLOW * (positions - self.view.state.q)
        values[self._channels.joint_slice] = np.clip(toward, -fastest, fastest)
        mask, now = self._channels.mask("joint"), self.view.state.time
        self._move(Intent(values, mask, self.gripper, _TOWARD.name, now))
        self.led, (self.success, self.done) = positions, judged

    @property
    def gripper(self) -> float:
        """What the gripper was sent last, 0 open, 1 closed."""
        return float(self._info["sent"][-1])

    def _move(self, intent: Intent, stops: bool = False) -> None:
        self.led = None
        seen, wall_clock = self._observation, time.perf_counter() - self._started
        self._driver.drive(self._steps, self.view.state, intent)
        self._diagnostics = self._driver.command.diagnostics
        self.brakes += Status(self._diagnostics.status).brakes
        sent = self._driver.action(self._steps)
        if stops and np.abs(sent[:-1]).max() < _CREEP:
            sent[:-1] = 0.0  # a controller may come ever nearer to rest
        commanded = time.perf_counter() - self._started
        self._observation, _, terminated, truncated, self._info = self.env.step(sent)
        self.success |= bool(self._info["is_success"])
        self.done |= terminated or truncated
        self.frame = Frame(
            state=seen["agent_pos"],
            environment=seen["environment_state"],
            images=seen.get("pixels", {}),
            intent=intent,
            action=self._info["sent"],
            command=sent.astype(np.float32),
            diagnostics=self._diagnostics,
            contacts=self._info["contacts"],
            success=self.success,
            done=self.done,
            wall_clock=wall_clock,
            number=self._steps,
            safe=self._steps + 1,
            plan=self._driver.command.plan or self._driver.command,
            commanded=commanded,
        )
        self._steps += 1
        self._look()

    def _look(self) -> None:
        self.view = View(self.env.robot.state(), self.env.task_state(), self._observation)

    @property
    def names(self) -> tuple[str, ...]:
        """LeRobot's names of `numbers`; what is no part of the robot or the scene keeps its own."""
        seen = tuple(map(lerobot_name, (*self.env.agent_names, *self.env.state_names)))
        if not self._told:
            return seen
        sent = (f"sent.{name}" for name in (*self.env.model.joints, "gripper"))
        return (*seen, *sent, "mode", "status", "distance", "contacts", "brakes", "success", "scene")

    def numbers(self) -> dict[str, float]:
        """Return the robot, the scene, what was sent in the last period, and how the controller fared.

        The mode is its place in the list of modes, −1 for a mask of one's own; the status that of `Status`;
        the distance the smallest one now, cut to 10 m.
        """
        seen = self._observation
        numbers = [*seen["agent_pos"], *seen["environment_state"]]
        if self._told:
            modes = list(MODES)
            mode = modes.index(self.mode.name) if self.mode.name in modes else -1
            status = _STATUSES.index(Status(self._diagnostics.status))
            distance = finite_distance(self._diagnostics.smallest_distance)
            contacts = self._info["contacts"]
            told = (mode, status, distance, contacts, self.brakes, self.success, self.scene)
            numbers += [*self._info["sent"], *told]
        return dict(zip(self.names, map(float, numbers), strict=True))

    @property
    def pictures(self) -> dict[str, Any]:
        """What the cameras see, (height, width, 3) uint8 each."""
        return dict(self._observation.get("pixels", {}))

    def close(self) -> None:
        """Give the pictures' contexts back."""
        self.env.close()

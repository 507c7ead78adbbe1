"""A session that somebody else's loop runs, one period at a time."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from handrail.collect.commands.recording import episode_seed
from handrail.collect.config import SessionConfig
from handrail.collect.lerobot.mode_action import ModeAction
from handrail.collect.lerobot.names import lerobot_name
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.scripted.steering import FOLLOW
from handrail.collect.seeds import evaluation_seed
from handrail.collect.session.build import build_controller, build_env, build_mode
from handrail.collect.session.loop import EpisodeLoop
from handrail.collect.session.mode_controller import ModeController
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Diagnostics, Status
from handrail.controllers.interface.intent import LONG_AGO, Intent
from handrail.datasets.recording.frames import Frame, finite_distance

_TOWARD = MODES["joints"]  # the mode in which joints are led to positions
_STATUSES = tuple(Status)


class Stepwise:
    """An episode loop in LeRobot's words; the caller steps it.

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
        loop: of the episode.
        frame: what happened in the last period; None before any.
        driven: whether an intent was completed in this episode.
        led: where the joints were led in the last period, (n,) [m, rad]; None if they were not.
    """

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
        self.loop = EpisodeLoop(self.env, ModeController(modes, build, self.mode))
        self.scene, self.episodes, self.frame = -1, 0, None

    def begin(self, scene: int) -> None:
        """Begin an episode in a scene, by its number: the same number, the same beginning."""
        self.scene = scene
        self.episodes += 1
        self.loop.begin(self.seed)
        self.driven, self.led, self.frame = False, None, None

    @property
    def seed(self) -> int:
        """Of the episode."""
        seed_of = evaluation_seed if self._evaluation else episode_seed
        return seed_of(self.config.seed, self.scene)

    @property
    def view(self) -> View:
        """What there is to see now."""
        return self.loop.look()

    @property
    def brakes(self) -> int:
        """Updates of this episode in which the controller braked the robot."""
        return self.loop.tally.brakes

    def step(self, intent: Intent) -> None:
        """Let the controller complete an intent, and the robot move for a period."""
        self._move(intent)
        self.driven = True

    def hold(self) -> None:
        """Brake; once the robot rests, time stands still."""
        self.loop.look()
        if not self.loop.rests:
            nothing = Intent.idle(self._channels, LONG_AGO)
            self._move(replace(nothing, gripper=self.gripper, mode=self.mode.name), EpisodeEvent.PAUSE)

    def lead(self, positions: FloatArray) -> None:
        """Lead the joints towards positions for a period, whatever the mode; that is no part of the task.

        Args:
            positions: (n,) [m, rad].
        """
        fastest, state = self.env.model.description.limits.velocity, self.view.state
        values, before = np.zeros(self._channels.size), positions if self.led is None else self.led
        toward = (positions - before) * self.fps + FOLLOW * (positions - state.q)
        values[self._channels.joint_slice] = np.clip(toward, -fastest, fastest)
        mask = self._channels.mask("joint")
        self._move(Intent(values, mask, self.gripper, _TOWARD.name, state.time), counts=False)
        self.led = positions

    @property
    def gripper(self) -> float:
        """What the gripper was sent last, 0 open, 1 closed."""
        return float(self.loop.now.info["sent"][-1])

    def _move(self, intent: Intent, event: EpisodeEvent | None = None, counts: bool = True) -> None:
        self.loop.look()
        self.frame, self.led = self.loop.step(intent, event, counts), None

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
        seen = self.loop.now.observation
        numbers = [*seen["agent_pos"], *seen["environment_state"]]
        if self._told:
            modes = list(MODES)
            mode = modes.index(self.mode.name) if self.mode.name in modes else -1
            diagnostics, info = self.frame.diagnostics if self.frame else Diagnostics(), self.loop.now.info
            status = _STATUSES.index(Status(diagnostics.status))
            distance = finite_distance(diagnostics.smallest_distance)
            told = (mode, status, distance, info["contacts"], self.brakes, self.loop.now.success, self.scene)
            numbers += [*info["sent"], *told]
        return dict(zip(self.names, map(float, numbers), strict=True))

    @property
    def pictures(self) -> dict[str, Any]:
        """What the cameras see, (height, width, 3) uint8 each."""
        return dict(self.loop.now.observation.get("pixels", {}))

    def close(self) -> None:
        """Give the pictures' contexts back."""
        self.env.close()

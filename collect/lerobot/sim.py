"""The simulated robot as LeRobot's `Robot`: an action is a part of the motion, a controller completes it."""

import logging
import time
import weakref
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from lerobot.robots import Robot

from handrail.collect.lerobot.configs import HandrailSimConfig
from handrail.collect.lerobot.mode_action import AGAIN, HOLD, NEXT, ModeAction, mode_loop, pressed
from handrail.collect.lerobot.names import POSITION, lerobot_name
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.scripted.steering import FOLLOW
from handrail.collect.seeds import episode_seed, evaluation_seed
from handrail.collect.session.build import build_env, build_mode
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Diagnostics, Status
from handrail.controllers.interface.intent import LONG_AGO, Intent
from handrail.controllers.numerics.threads import single_threaded
from handrail.datasets.recording.frames import Frame, finite_distance

_REHEARSED = 3  # periods before the first, in which what is compiled at first use is compiled
_TOWARD = MODES["joints"]  # the mode in which joints are led to positions
_TOLD = ("mode", "status", "distance", "contacts", "brakes", "success", "scene")
_newest: list["weakref.ref[HandrailSim]"] = []


def newest_robot() -> "HandrailSim | None":
    """Return the robot of this process that was made last; LeRobot shows it to nobody."""
    return _newest[0]() if _newest else None


class Pace:
    """Waits so that periods do not come more often than they last; one that keeps time itself never waits.

    Args:
        period: [s].
        clock: [s].
        sleep: waits so long [s].
    """

    def __init__(
        self,
        period: float,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._period, self._clock, self._sleep = period, clock, sleep
        self._due = -float("inf")

    def wait(self) -> None:
        """Wait until another period may begin; half a period early is in time."""
        now = self._clock()
        ahead = self._due - now
        if ahead > self._period / 2:
            self._sleep(ahead)
        self._due = max(self._due, now) + self._period if ahead > -self._period else now + self._period


class Uncalibrated:
    """A device of LeRobot's of which nothing is to be calibrated or configured."""

    @property
    def is_calibrated(self) -> bool:
        """Nothing is to be calibrated."""
        return True

    def calibrate(self) -> None:
        """Do nothing."""

    def configure(self) -> None:
        """Do nothing."""


class HandrailSim(Uncalibrated, Robot):
    """A robot in MuJoCo with a task; `handrail_sim` in LeRobot's commands.

    Every `send_action` moves it for one period. An action that is not finite brakes, and is counted. The same
    action once more (the same object, not only the same numbers) is how LeRobot pauses. It is a velocity, so
    the robot brakes, and time stands still. When `lerobot-rollout` has led the joints back to where they were
    at connect(), the next scene begins.

    Args:
        config: its settings.

    Attributes:
        session: settings of the session behind it.
        env: the robot, its world and a task.
        mode: teleop mode.
        action: what is asked for every period.
        loop: of the episode.
        scene: number of the episode's beginning: the same number, the same beginning.
        episodes: how many have begun.
        frame: what happened in the last period; None before any.
        watch: is told of every action whether it is the same one once more; returns a button, or "".
    """

    config_class = HandrailSimConfig
    name = "handrail_sim"
    frame: Frame | None
    _connected = False

    def __init__(self, config: HandrailSimConfig) -> None:
        super().__init__(config)
        self._config, self.session = config, config.session()
        self.env = build_env(self.session, config.fps)
        self.mode = build_mode(self.session, self.env.model)
        self._channels = Channels.of(self.env.model.description)
        self.action = ModeAction(self.mode, self._channels, self.env.model.hand.name)
        self.loop = mode_loop(self.env, self.session.task, self.mode, _TOWARD)
        self.cameras = dict.fromkeys(self.env.cameras)  # LeRobot counts them
        self.scene, self.episodes, self.frame = -1, 0, None
        self._driven, self._led = False, None
        self.watch: Callable[[bool], str] = lambda repeated: ""
        self._given: tuple[dict[str, Any], dict[str, Any]] | None = None
        self._pace, self._open = Pace(self.env.period), ExitStack()
        _newest[:] = [weakref.ref(self)]

    @cached_property
    def observation_features(self) -> dict[str, Any]:
        """Names of what is observed: numbers, and pictures by camera."""
        picture = (*self.env.image_size, 3)
        return dict.fromkeys(self._names, float) | dict.fromkeys(self.cameras, picture)

    @cached_property
    def action_features(self) -> dict[str, type]:
        """Names of the numbers of an action: the mode's channels and the grippers."""
        return dict.fromkeys(self.action.names, float)

    @property
    def is_connected(self) -> bool:
        """Whether an episode has begun."""
        return self._connected

    @property
    def seed(self) -> int:
        """Of the episode."""
        seed_of = evaluation_seed if self._config.evaluation else episode_seed
        return seed_of(self.session.seed, self.scene)

    @property
    def view(self) -> View:
        """The observation now."""
        return self.loop.look()

    @property
    def grippers(self) -> tuple[float, ...]:
        """The last command of the grippers, 0 open, 1 closed."""
        return tuple(self.loop.now.info["sent"][self.env.model.size :].tolist())

    def connect(self, calibrate: bool = True) -> None:
        """Begin the first episode, everything compiled."""
        if self._connected:
            raise HandrailError("handrail_sim: expected to be connected once, is connected already")
        self._open.enter_context(single_threaded())
        self._open.callback(self.env.close)
        self._begin(self._config.episode)
        for _ in range(_REHEARSED):
            self._move(self.action.intent(np.zeros(len(self.action.names)), self.view.state.time))
        self._begin(self._config.episode)
        self._first = self._positions(self._numbers())
        self._connected = True

    def get_observation(self) -> dict[str, Any]:
        """Return the robot, the scene, what was sent and how the controller fared; and the pictures."""
        self._check_connected()
        if self._led is not None and np.array_equal(self._led, self._first):
            self._begin(self.scene + self._driven)
        return self._numbers() | self.loop.now.observation.get("pixels", {})

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        """Do what an action asks for, for one period; return it as it was understood.

        A button beside the channels begins another episode (`handrail.next`), the same one again
        (`handrail.again`), or brakes and lets time stand still (`handrail.hold`); so does the same action
        once more. Positions of all joints (`x.pos`, …) without any channel lead the joints there, unless
        somebody who looks on presses a button.
        """
        self._check_connected()
        if self._config.realtime:
            self._pace.wait()
        leads = not self.action.is_in(action) and all(name in action for name in self._joints)
        numbers = np.empty(0) if leads else self.action.numbers(action).astype(np.float32)  # as a dataset's
        repeated = self._given is not None and action is self._given[0] and action == self._given[1]
        if not leads and pressed(action) != HOLD:  # whoever holds between two of the same, wants nothing new
            self._given = action, dict(action)
        button = self.watch(repeated) or (HOLD if repeated else pressed(action))
        if button in (NEXT, AGAIN):
            self._begin(self.scene + (button == NEXT))
        elif button == HOLD:
            self._hold()
        elif leads:
            self._lead(self._positions(action))
        else:
            self._move(self.action.intent(numbers, self.view.state.time))
            self._driven = True
        return action if leads else dict(zip(self.action.names, map(float, numbers), strict=True))

    def disconnect(self) -> None:
        """Stop the robot and close its world."""
        self._check_connected()
        self._report()
        self._connected = self._driven = False
        self.env.plant.stop()
        self._open.close()

    def _begin(self, scene: int) -> None:
        """Begin an episode in a scene."""
        self._report()
        self.scene, self.episodes = scene, self.episodes + 1
        self.loop.begin(self.seed)
        self._driven, self._led, self.frame = False, None, None

    def _hold(self) -> None:
        """Brake; once the robot rests, time stands still."""
        self.loop.look()
        if not self.loop.rests:
            nothing, brakes = Intent.idle(self._channels, LONG_AGO), self.loop.tally.brakes
            self._move(replace(nothing, grippers=self.grippers, mode=self.mode.name), EpisodeEvent.PAUSE)
            self.loop.tally.brakes = brakes  # it was asked for

    def _lead(self, positions: FloatArray) -> None:
        """Lead the joints towards positions, (n,) [m, rad], for a period; that is no part of the task."""
        fastest, state = self.env.model.description.limits.velocity, self.view.state
        values, before = np.zeros(self._channels.size), positions if self._led is None else self._led
        toward = (positions - before) * self.env.fps + FOLLOW * (positions - state.q)
        values[self._channels.joint_slice] = np.clip(toward, -fastest, fastest)
        mask = self._channels.mask("joint")
        self._move(Intent(values, mask, self.grippers, _TOWARD.name, state.time), counts=False)
        self._led = positions

    def _move(self, intent: Intent, event: EpisodeEvent | None = None, counts: bool = True) -> None:
        self.loop.look()
        self.frame, self._led = self.loop.step(intent, event, counts), None

    @cached_property
    def _names(self) -> tuple[str, ...]:
        """LeRobot's names of the numbers; what is no part of the robot or the scene keeps its own."""
        seen = tuple(map(lerobot_name, (*self.env.agent_names, *self.env.state_names)))
        grippers = (hand.named("gripper") for hand in self.env.model.description.hands)
        sent = (f"sent.{name}" for name in (*self.env.model.joints, *grippers))
        told = (f"{name}.number" if name in self.cameras else name for name in _TOLD)
        return (*seen, *sent, *told) if self._config.diagnostics else seen

    def _numbers(self) -> dict[str, float]:
        """Return the robot, the scene, what was sent in the last period, and how the controller fared.

        The mode is its place in the list of modes, −1 for a mask of one's own; the status that of `Status`;
        the distance the smallest one that the controller has measured, cut to 10 m; 10 before it has.
        """
        now, modes = self.loop.now, list(MODES)
        numbers = [*now.observation["agent_pos"], *now.observation["environment_state"]]
        if self._config.diagnostics:
            mode = modes.index(self.mode.name) if self.mode.name in modes else -1
            diagnostics = self.frame.diagnostics if self.frame else Diagnostics()
            status = list(Status).index(Status(diagnostics.status))
            told = (mode, status, finite_distance(diagnostics.smallest_distance), now.info["contacts"])
            numbers += [*now.info["sent"], *told, self.loop.tally.brakes, now.success, self.scene]
        return dict(zip(self._names, map(float, numbers), strict=True))

    @cached_property
    def _joints(self) -> tuple[str, ...]:
        return tuple(name + POSITION for name in self.env.model.joints)

    def _positions(self, numbers: Mapping[str, float]) -> FloatArray:
        return np.array([numbers[name] for name in self._joints], float)

    def _report(self) -> None:
        """Log how a scene went in which something was done."""
        if self._driven:
            result = "success" if self.loop.now.success else "no success"
            logging.info("handrail_sim: scene %d: %s, %d brakes", self.scene, result, self.loop.tally.brakes)

    def _check_connected(self) -> None:
        if not self._connected:
            raise HandrailError("handrail_sim: expected connect() before anything else")

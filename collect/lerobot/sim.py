"""The simulated robot as LeRobot's `Robot`: an action is a part of the motion, a controller completes it."""

import logging
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from functools import cached_property
from typing import Any

import numpy as np
from lerobot.robots import Robot

from handrail.collect.lerobot.configs import HandrailSimConfig
from handrail.collect.lerobot.link import announce
from handrail.collect.lerobot.mode_action import AGAIN, HOLD, NEXT, pressed
from handrail.collect.lerobot.names import POSITION
from handrail.collect.lerobot.stepwise import Stepwise
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.threads import single_threaded

_REHEARSED = 3  # periods before the first, in which what is compiled at first use is compiled


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


class HandrailSim(Robot):
    """A robot in MuJoCo with a task; `handrail_sim` in LeRobot's commands.

    Every `send_action` moves it for one period. An action that is not finite brakes, and is counted. When
    `lerobot-rollout` has led the joints back to where they were at connect(), the next scene begins.

    Args:
        config: its settings.

    Attributes:
        stepwise: the session behind it.
    """

    config_class = HandrailSimConfig
    name = "handrail_sim"

    def __init__(self, config: HandrailSimConfig) -> None:
        self._connected = False
        super().__init__(config)
        self._config = config
        self.stepwise = Stepwise(config.session(), config.fps, config.diagnostics, config.evaluation)
        self.cameras = dict.fromkeys(self.stepwise.env.cameras)  # LeRobot counts them
        self._pace = Pace(1.0 / config.fps)
        self._open = ExitStack()
        announce(self)

    @cached_property
    def observation_features(self) -> dict[str, Any]:
        """Names of what is observed: numbers, and pictures by camera."""
        height, width = self.stepwise.env.image_size
        return dict.fromkeys(self.stepwise.names, float) | dict.fromkeys(self.cameras, (height, width, 3))

    @cached_property
    def action_features(self) -> dict[str, type]:
        """Names of the numbers of an action: the mode's channels and the gripper."""
        return dict.fromkeys(self.stepwise.action.names, float)

    @property
    def is_connected(self) -> bool:
        """Whether an episode has begun."""
        return self._connected

    @property
    def is_calibrated(self) -> bool:
        """Nothing is to be calibrated."""
        return True

    def calibrate(self) -> None:
        """Do nothing."""

    def configure(self) -> None:
        """Do nothing."""

    def connect(self, calibrate: bool = True) -> None:
        """Begin the first episode, everything compiled."""
        if self._connected:
            raise HandrailError("handrail_sim: expected to be connected once, is connected already")
        self._open.enter_context(single_threaded())
        self._open.callback(self.stepwise.close)
        session = self.stepwise
        session.begin(self._config.episode)
        for _ in range(_REHEARSED):
            session.step(session.action.intent(session.action.still(), session.view.state.time))
        session.begin(self._config.episode)
        self._first = self._positions(session.numbers())
        self._connected = True

    def get_observation(self) -> dict[str, Any]:
        """Return the robot, the scene, what was sent and how the controller fared; and the pictures."""
        self._check_connected()
        session = self.stepwise
        if session.led is not None and np.array_equal(session.led, self._first):
            self._begin(session.scene + session.driven)
        return {**session.numbers(), **session.pictures}

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        """Do what an action asks for, for one period; return it as it was understood.

        A button beside the channels begins another episode (`handrail.next`), the same one again
        (`handrail.again`), or brakes and lets time stand still (`handrail.hold`). Positions of all joints
        (`x.pos`, …) without any channel lead the joints there.
        """
        self._check_connected()
        session, steered = self.stepwise, self.stepwise.action.is_in(action)
        if self._config.realtime:
            self._pace.wait()
        if not steered and all(name in action for name in self._joints):
            session.lead(self._positions(action))
            return action
        numbers = session.action.numbers(action).astype(np.float32)  # as exact as a dataset keeps them
        button = pressed(action)
        if button in (NEXT, AGAIN):
            self._begin(session.scene + (button == NEXT))
        elif button == HOLD:
            session.hold()
        else:
            session.step(session.action.decided(numbers, session.view.state.time))
        return dict(zip(session.action.names, map(float, numbers), strict=True))

    @cached_property
    def _joints(self) -> tuple[str, ...]:
        return tuple(name + POSITION for name in self.stepwise.env.model.joints)

    def _positions(self, numbers: Mapping[str, float]) -> FloatArray:
        return np.array([numbers[name] for name in self._joints], float)

    def _begin(self, scene: int) -> None:
        self._report()
        self.stepwise.begin(scene)

    def _report(self) -> None:
        """Log how a scene went in which something was done."""
        session = self.stepwise
        if session.driven:
            result = "success" if session.loop.now.success else "no success"
            logging.info("handrail_sim: scene %d: %s, %d brakes", session.scene, result, session.brakes)

    def disconnect(self) -> None:
        """Stop the robot and close its world."""
        self._check_connected()
        self._connected = False
        self._report()
        self.stepwise.env.robot.stop()
        self._open.close()

    def _check_connected(self) -> None:
        if not self._connected:
            raise HandrailError("handrail_sim: expected connect() before anything else")

"""The scripted operator as LeRobot's `Teleoperator`."""

import time
from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum

import numpy as np

from handrail.collect.lerobot.configs import HandrailScriptedConfig
from handrail.collect.lerobot.mode_action import HOLD, NEXT
from handrail.collect.lerobot.stepwise import Stepwise
from handrail.collect.lerobot.teleoperator import SimTeleoperator
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.build import build_operator

_MARGIN = 2.0  # periods by which LeRobot's clock may be behind ours


class ClockPhase(StrEnum):
    """What a teleoperator that runs by itself does now."""

    DRIVE = "drive"
    WAIT = "wait"
    NEXT = "next"  # begin another episode; said once


class EpisodeClock:
    """Follows the phases of `lerobot-record`: an episode of so many seconds, then a time for the reset.

    The scene changes in the middle of the reset's time. The robot then waits at its beginning until that time
    is over, so that a recorded episode begins where a scene begins. Without an episode's time it follows the
    task: it rests for a second once it is done, and begins another one.

    Args:
        episode: time of an episode, `--dataset.episode_time_s`; 0 to follow the task [s].
        reset: `--dataset.reset_time_s` [s].
        margin: by which a clock may be late [s].
        clock: [s].
    """

    def __init__(
        self,
        episode: float,
        reset: float,
        margin: float,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._episode, self._reset, self._margin, self._clock = episode, reset, margin, clock
        self._begun: float | None = None
        self._over: float | None = None
        self._changed = False

    def phase(self, done: bool) -> ClockPhase:
        """Return what to do now.

        Args:
            done: whether the task is.
        """
        now = self._clock()
        if self._begun is None:
            self._begun = now
        if self._over is None and self._is_over(now, done):
            self._over = now
        if self._over is None:
            return ClockPhase.DRIVE
        return self._between(now)

    def _is_over(self, now: float, done: bool) -> bool:
        assert self._begun is not None
        return now - self._begun >= self._episode if self._episode else done

    def _between(self, now: float) -> ClockPhase:
        assert self._begun is not None
        assert self._over is not None
        start = self._begun + self._episode if self._episode else self._over
        if not self._changed:
            if now < start + self._reset / 2:
                return ClockPhase.WAIT
            self._changed = True
            return ClockPhase.NEXT
        if now < start + self._reset + self._margin:
            return ClockPhase.WAIT
        self._begun, self._over, self._changed = now, None, False
        return ClockPhase.DRIVE


class HandrailScripted(SimTeleoperator):
    """A script with a human-like hand steers `handrail_sim`; the same scene, the same motion.

    Args:
        config: its settings.
    """

    config_class = HandrailScriptedConfig
    name = "handrail_scripted"

    def __init__(self, config: HandrailScriptedConfig) -> None:
        config.check()
        super().__init__(config)
        self._config = config

    def _open(self, session: Stepwise) -> None:
        config = self._config
        who = replace(session.config, noise=config.noise, person=config.person)
        who.check()
        self._operator = build_operator(who, session.mode, session.env.model)
        self._clock = EpisodeClock(config.episode_time_s, config.reset_time_s, _MARGIN / session.fps)
        self._begun = 0

    def _act(self, session: Stepwise) -> dict[str, float]:
        phase = self._clock.phase(session.loop.now.done)
        if phase is not ClockPhase.DRIVE:
            return session.action.still(session.gripper) | {NEXT if phase is ClockPhase.NEXT else HOLD: 1.0}
        if session.episodes != self._begun:
            self._operator.reset(session.view, np.random.default_rng([session.seed, 1]))
            self._begun = session.episodes
        asked = self._operator.act(session.view)
        assert not isinstance(asked, EpisodeEvent)  # of which a script says none
        return session.action.action(asked, session.view.tool.rotation)

"""The scripted operator as LeRobot's `Teleoperator`."""

import time
from collections.abc import Callable
from dataclasses import replace

from handrail.collect.lerobot.configs import HandrailScriptedConfig
from handrail.collect.lerobot.mode_action import HOLD, NEXT
from handrail.collect.lerobot.sim import HandrailSim
from handrail.collect.lerobot.teleoperator import SimTeleoperator
from handrail.collect.operators.operator import Operator
from handrail.collect.session.build import build_operator

_MARGIN = 2.0  # periods by which LeRobot's clock may be behind ours


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
        self, episode: float, reset: float, margin: float, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._episode, self._reset, self._margin, self._clock = episode, reset, margin, clock
        self._begun: float | None = None
        self._over: float | None = None
        self._changed = False

    def button(self, done: bool) -> str:
        """Return the button to press now: none while it drives, else HOLD, and NEXT once.

        Args:
            done: whether the task is.
        """
        now = self._clock()
        if self._begun is None:
            self._begun = now
        if self._over is None and (now - self._begun >= self._episode if self._episode else done):
            self._over = self._begun + self._episode if self._episode else now
        if self._over is None:
            return ""
        if not self._changed:
            self._changed = now >= self._over + self._reset / 2
            return NEXT if self._changed else HOLD
        if now < self._over + self._reset + self._margin:
            return HOLD
        self._begun, self._over, self._changed = now, None, False
        return ""


class HandrailScripted(SimTeleoperator):
    """A script with a human-like hand steers `handrail_sim`; the same scene, the same motion."""

    config_class = HandrailScriptedConfig
    name = "handrail_scripted"
    is_person = False

    def _made(self, robot: HandrailSim) -> Operator:
        config = self._settings
        person = replace(robot.session, noise=config.noise, person=config.person)
        person.check()
        margin = _MARGIN * robot.env.period
        self._clock = EpisodeClock(config.episode_time_s, config.reset_time_s, margin)
        return build_operator(person, robot.mode, robot.env.model)

    def _pressed(self, robot: HandrailSim) -> str:
        if self._has_watched:  # it helps a policy, whose pauses are for other scenes
            return ""
        return self._clock.button(robot.loop.now.done)

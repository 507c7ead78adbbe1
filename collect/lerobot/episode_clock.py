"""When LeRobot's loop records and when it waits for a reset: it tells nobody, so the clock has to say."""

import time
from collections.abc import Callable
from enum import StrEnum


class Phase(StrEnum):
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

    def phase(self, done: bool) -> Phase:
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
            return Phase.DRIVE
        return self._between(now)

    def _is_over(self, now: float, done: bool) -> bool:
        assert self._begun is not None
        return now - self._begun >= self._episode if self._episode else done

    def _between(self, now: float) -> Phase:
        assert self._begun is not None
        assert self._over is not None
        start = self._begun + self._episode if self._episode else self._over
        if not self._changed:
            if now < start + self._reset / 2:
                return Phase.WAIT
            self._changed = True
            return Phase.NEXT
        if now < start + self._reset + self._margin:
            return Phase.WAIT
        self._begun, self._over, self._changed = now, None, False
        return Phase.DRIVE

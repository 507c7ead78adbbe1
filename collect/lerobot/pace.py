"""Keeps a simulated robot from being faster than real time, whoever has the loop."""

import time
from collections.abc import Callable


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

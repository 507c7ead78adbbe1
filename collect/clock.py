"""A clock that counts the time in which the computer sleeps; `time.monotonic` stands still meanwhile."""

import time


def time_with_sleep() -> float:
    """Return the time that has passed since some moment, with that of sleep [s]."""
    return time.clock_gettime(getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC))  # macOS's counts it

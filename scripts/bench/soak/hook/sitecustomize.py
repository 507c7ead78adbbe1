"""Python loads this first in every process of a command under test: a slow disk and a clock that jumps.

The present values stand in the file that HANDRAIL_SOAK names: `{"delay": seconds, "shift": seconds}`. Every
call that waits for the disk then takes so much longer, and the wall clock is so far off. The monotonic clock
is left alone, as a real jump leaves it.
"""

import contextlib
import json
import os
import time

_FILE = os.environ.get("HANDRAIL_SOAK", "")
_real_time, _real_time_ns, _real_fsync, _real_replace = time.time, time.time_ns, os.fsync, os.replace
_seen: tuple[int, dict[str, float]] = (-1, {})


def _now(name):
    global _seen
    with contextlib.suppress(OSError, ValueError):
        stamp = os.stat(_FILE).st_mtime_ns
        if stamp != _seen[0]:
            with open(_FILE) as file:
                _seen = (stamp, json.load(file))
    return _seen[1].get(name, 0.0)


def _slow_fsync(*arguments, **named):
    time.sleep(_now("delay"))
    return _real_fsync(*arguments, **named)


def _slow_replace(*arguments, **named):
    time.sleep(_now("delay"))
    return _real_replace(*arguments, **named)


def _shifted_time():
    return _real_time() + _now("shift")


def _shifted_time_ns():
    return _real_time_ns() + int(_now("shift") * 1e9)


if _FILE:
    os.fsync, os.replace = _slow_fsync, _slow_replace
    time.time, time.time_ns = _shifted_time, _shifted_time_ns

"""Pages without a browser: one that drives and takes times, others that watch."""

import threading
import time
from collections import defaultdict
from contextlib import suppress
from typing import Any

import numpy as np
from websockets.exceptions import WebSocketException

from handrail.scripts.bench.page import Page, connected

_MOVES = 1e-3  # faster, the base is commanded to move [m/s]
_HOLDS, _RESTS = 0.5, (0.1, 0.3)  # how long a key is held, and then let go [s]


class Spectator:
    """Counts the frames and pictures that a page gets that watches.

    Args:
        address: of the cockpit.
        name: of the page.
        pause: between two messages that it takes [s].
    """

    def __init__(self, address: str, name: str, pause: float = 0.0) -> None:
        self.frames = self.pictures = 0
        self._pause = pause
        self._socket = connected(address, name, max_queue=1)
        threading.Thread(target=self._watch, daemon=True).start()

    def close(self) -> None:
        """Watch no more."""
        self._socket.close()

    def _watch(self) -> None:
        with suppress(WebSocketException):
            for message in self._socket:
                self.pictures += isinstance(message, bytes)
                self.frames += isinstance(message, str) and message.startswith('{"kind":"frame"')
                if self._pause:
                    time.sleep(self._pause)


class DrivingPage(Page):
    """Holds a key and lets go of it, again and again, and takes the time until the base does as it is told.

    Args:
        address: of the cockpit.

    Attributes:
        times: latencies [s], by what they are of.
    """

    def __init__(self, address: str) -> None:
        super().__init__(address, "page-that-drives", self._see)
        self.times, self._is_lost = defaultdict[str, list[float]](list), False

    def drive(self, seconds: float, rng: np.random.Generator) -> None:
        """Hold and let go for some time; where the robot has lost its input, begin anew."""
        self.times.clear()
        self.frames = self.pictures = 0
        end, sign = time.monotonic() + seconds, 1.0
        while time.monotonic() < end:
            sign = -sign
            self.run(rng.uniform(*_RESTS))
            self._is_lost, pressed = False, self._deflect(sign)
            came = self.until(lambda frame: self._is_lost or _speed(frame) > _MOVES)
            began = self.frame["commanded"]
            self.run(_HOLDS)
            if self._is_lost:
                continue
            self.times["key to command"].append(began - pressed)
            self.times["key to page"].append(came - pressed)
            fastest = _speed(self.frame)
            released = self._deflect(0.0)
            self.until(lambda frame, most=fastest: _speed(frame) < most - _MOVES)
            self.times["release to brake"].append(self.frame["commanded"] - released)
            self.until(lambda frame: _speed(frame) < _MOVES)
            self.times["release to rest"].append(self.frame["commanded"] - released)

    def _deflect(self, value: float) -> float:
        """Push the base's stick; return when [s]."""
        self.axes = [value if name == "base.vx" else 0.0 for name in self.channels]
        now = time.monotonic()
        self.say()
        return now

    def _see(self, frame: dict[str, Any]) -> None:
        if frame["phase"] == "driving":
            self.times["round trip"].append(frame["round_trip"])
        if frame["phase"] == "lost":
            self._is_lost = True
            self.axes = [0.0] * len(self.channels)


def _speed(frame: dict[str, Any]) -> float:
    """Return how fast the base is commanded to go [m/s]."""
    return float(np.hypot(*frame["v"][:2]))

"""A page of the cockpit that is nothing but a socket, and a hand that drives."""

import json
import time
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

_PERIOD = 0.04  # between two inputs [s]
_EPISODE = (2.0, 6.0)  # [s]
_ARMED = 0.4  # everything is let go for so long first [s]
_AGAIN = 0.5  # between two asks [s]
_RETRY = 0.7  # as the real page [s]


class Page:
    """Drives whatever the robot does, and ends an episode every few seconds.

    Args:
        address: of the cockpit.
        rng: of where it drives.

    Attributes:
        saved: how many episodes the recording has said are saved.
        frames: how many it has seen.
    """

    def __init__(self, address: str, rng: np.random.Generator) -> None:
        self._address, self._rng = address, rng
        self.saved = self.frames = 0
        self._channels, self._frame = 18, {}
        self._since = self._said = self._asked = 0.0
        self._phase, self._ends, self._late = "", 0.0, (0.0, 0.0)
        self._axes = np.zeros(18)
        self._socket: ClientConnection | None = None
        self._sequence, self._is_driving = 0, False

    def turn(self) -> None:
        """Hear what there is and say where the inputs are; a server that is gone is asked again."""
        try:
            socket = self._opened()
            self._hear(socket)
            self._say(socket)
        except (OSError, WebSocketException, TimeoutError):
            self.close()
            time.sleep(_RETRY)

    def reopen(self) -> None:
        """Close the page, and open it again at the next turn."""
        self.close()
        time.sleep(self._rng.uniform(0.0, 5.0))

    def lag(self, seconds: float) -> None:
        """Answer old frames for a while."""
        stamp, until = self._frame.get("stamp", 0.0), time.monotonic() + seconds
        while time.monotonic() < until:
            self._late = (stamp, until)
            self.turn()

    def babble(self) -> None:
        """Say what is no message."""
        try:
            socket = self._opened()
            for words in ("{", "[]", '{"kind": "drive"}', '{"kind": "drive", "seq": 1e99}', "\0" * 5000):
                socket.send(words)
        except (OSError, WebSocketException, TimeoutError):
            self.close()

    def close(self) -> None:
        """Close the socket."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _opened(self) -> ClientConnection:
        if self._socket is None:
            parts = urlsplit(self._address)
            self._socket = connect(
                f"ws://{parts.netloc}/drive?page=soak-of-handrail",
                origin=Origin(f"{parts.scheme}://{parts.netloc}"),
                compression=None,
                open_timeout=20,
                ping_interval=None,
            )
            self._sequence, self._is_driving = 0, False
        return self._socket

    def _hear(self, socket: ClientConnection) -> None:
        """Take all that has come, for as long as a period."""
        until = time.monotonic() + _PERIOD
        while (left := until - time.monotonic()) > 0.0:
            try:
                self._take(json.loads(socket.recv(timeout=left)))
            except TimeoutError:
                return
            except UnicodeDecodeError:
                continue  # a picture

    def _take(self, said: dict[str, Any]) -> None:
        if said["kind"] == "stage":
            self._channels = len(said["stage"]["channels"])
        elif said["kind"] == "you":
            self._is_driving = said["driving"]
        elif said["kind"] == "frame":
            self._frame = said["frame"]
            self.frames += 1
            self.saved = self._frame["saved"]
            if self._frame["phase"] != self._phase:
                self._phase, self._since = self._frame["phase"], time.monotonic()
                self._ends = self._since + self._rng.uniform(*_EPISODE)

    def _say(self, socket: ClientConnection) -> None:
        now = time.monotonic()
        if not self._frame:
            return
        if not self._is_driving:
            self._ask(socket, "take", True)
        elif self._phase in ("ready", "paused"):
            self._ask(socket, "start", True)
        elif self._phase == "stopped":
            self._ask(socket, "stop", False)
        elif self._phase == "driving" and now > self._ends:
            self._ask(socket, str(self._rng.choice(("success", "success", "failure", "discard"))), True)
        self._sequence += 1
        late, until = self._late
        echo = late if now < until else self._frame["stamp"]
        said = {"kind": "drive", "seq": self._sequence, "echo": echo, "on": True, "device": "keyboard"}
        said |= {"grip": False, "axes": self._moved(now), "view": 0.0, "targets": []}
        socket.send(json.dumps(said))

    def _ask(self, socket: ClientConnection, what: str, value: bool) -> None:
        if time.monotonic() > self._asked + _AGAIN:
            self._asked = time.monotonic()
            socket.send(json.dumps({"kind": "ask", "what": what, "value": value}))

    def _moved(self, now: float) -> list[float]:
        """Return the deflections: nothing at first and when lost, then a hand that wanders."""
        if self._phase != "driving" or now < self._since + _ARMED:
            return [0.0] * self._channels
        if len(self._axes) != self._channels:
            self._axes = np.zeros(self._channels)
        self._axes = np.clip(0.95 * self._axes + self._rng.normal(0.0, 0.15, self._channels), -1.0, 1.0)
        return [round(float(x), 3) for x in self._axes]

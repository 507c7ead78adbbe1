"""A page of the cockpit that is nothing but a socket: it drives, or watches."""

import json
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

_SAYS = 0.025  # from one input to the next at most [s]
_PATIENCE = 300.0  # until a frame is as it is waited for [s]
_PLAIN: Any = {"compression": None, "max_size": None, "ping_interval": None, "open_timeout": _PATIENCE}


def connected(address: str, name: str, **options: Any) -> ClientConnection:
    """Return the connection of a page."""
    parts = urlsplit(address)
    place, origin = f"ws://{parts.netloc}/drive?page={name}", Origin(f"{parts.scheme}://{parts.netloc}")
    return connect(place, origin=origin, **_PLAIN, **options).__enter__()  # whoever asked closes it


class Page:
    """Takes what the cockpit sends, and sends where its inputs are.

    Args:
        address: of the cockpit.
        name: of the page.
        on_frame: called with every frame.

    Attributes:
        frame: the newest; empty before any.
        came: when it came [s].
        channels: of the session.
        is_driving: whether the cockpit takes this page's inputs.
        axes: deflection of each channel.
        echo: stamp of the frame that it answers; None for the newest.
        frames, pictures: how many came.
    """

    def __init__(
        self, address: str, name: str, on_frame: Callable[[dict[str, Any]], None] = lambda frame: None
    ) -> None:
        self._address, self._name, self._on_frame = address, name, on_frame
        self._socket: ClientConnection | None = None
        self._sequence, self._said = 0, 0.0
        self.frame: dict[str, Any] = {}
        self.channels: list[str] = []
        self.axes: list[float] = []
        self._grips: list[bool] = []
        self.is_driving, self.came = False, 0.0
        self.echo: float | None = None
        self.frames = self.pictures = 0

    @property
    def socket(self) -> ClientConnection:
        """The connection, opened where there is none."""
        if self._socket is None:
            self._socket = connected(self._address, self._name)
            self._sequence, self.is_driving = 0, False
        return self._socket

    def close(self) -> None:
        """Close the connection."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def turn(self) -> None:
        """Take one message, or wait for a moment; send the inputs after a frame, and when it is time."""
        try:
            message = self.socket.recv(timeout=_SAYS)
        except TimeoutError:
            message = ""
        if isinstance(message, bytes):
            self.pictures += 1
        elif message:
            self._take(json.loads(message))
        if self.came > self._said or time.monotonic() > self._said + _SAYS:
            self.say()

    def run(self, seconds: float) -> None:
        """Take turns for so long."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.turn()

    def until(self, holds: Callable[[dict[str, Any]], bool]) -> float:
        """Take turns until something holds of the newest frame; return when that came [s]."""
        end = time.monotonic() + _PATIENCE
        while not (self.frame and holds(self.frame)):
            if time.monotonic() > end:
                raise TimeoutError(f"the cockpit stayed {self.frame.get('phase', 'silent')}")
            self.turn()
        return self.came

    def ask(self, what: str, value: bool = True) -> None:
        """Ask for something once."""
        self.socket.send(json.dumps({"kind": "ask", "what": what, "value": value}))

    def say(self) -> None:
        """Send where the inputs are."""
        self._said = time.monotonic()
        if not self.channels or not self.frame:
            return
        if len(self.axes) != len(self.channels):
            self.axes = [0.0] * len(self.channels)
        self._sequence += 1
        echo = self.frame["stamp"] if self.echo is None else self.echo
        inputs = {"device": "keyboard", "grips": self._grips, "axes": self.axes, "view": 0.0, "targets": []}
        self.socket.send(
            json.dumps({"kind": "drive", "seq": self._sequence, "echo": echo, "on": True} | inputs)
        )

    def _take(self, message: dict[str, Any]) -> None:
        if message["kind"] == "stage":
            self.channels = message["stage"]["channels"]
            self._grips = [False] * len(message["stage"]["hands"])
        elif message["kind"] == "you":
            self.is_driving = message["driving"]
        elif message["kind"] == "frame":
            self.frame, self.came = message["frame"], time.monotonic()
            self.frames += 1
            self._on_frame(self.frame)

"""Pages without a browser: one that drives and takes times, others that watch."""

import asyncio
import json
import time
from collections.abc import Callable
from typing import Any, Self
from urllib.parse import urlsplit

import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Origin

_SAYS = 0.025  # from one input to the next [s]
_MOVES = 1e-3  # faster, the base is commanded to move [m/s]
_HOLDS, _RESTS = 0.5, (0.1, 0.3)  # how long a key is held, and then let go [s]
_PATIENCE = 300.0  # until a page is told something [s]


def connected(address: str, name: str, **options: Any) -> connect:
    """Return the connection of a page."""
    parts = urlsplit(address)
    origin = Origin(f"{parts.scheme}://{parts.netloc}")
    return connect(
        f"ws://{parts.netloc}/drive?page={name}",
        origin=origin,
        compression=None,
        max_size=None,
        ping_interval=None,
        open_timeout=_PATIENCE,
        **options,
    )


class Spectator:
    """Counts what a page that watches gets.

    Args:
        address: of the cockpit.
        name: of the page.
        pause: between two messages that it takes [s].

    Attributes:
        counts: messages, by kind: frames and pictures.
    """

    def __init__(self, address: str, name: str, pause: float = 0.0) -> None:
        self._address, self._name, self._pause = address, name, pause
        self.counts = {"frames": 0, "pictures": 0}

    async def watch(self) -> None:
        """Watch, for ever."""
        async with connected(self._address, self._name, max_queue=1) as socket:
            async for message in socket:
                if isinstance(message, bytes):
                    self.counts["pictures"] += 1
                elif message.startswith('{"kind":"frame"'):
                    self.counts["frames"] += 1
                if self._pause:
                    await asyncio.sleep(self._pause)


class DrivingPage:
    """Holds a key and lets go of it, again and again, and takes the time until the base does as it is told.

    Args:
        socket: to the cockpit.

    Attributes:
        frame: the newest.
        times: latencies [s], by what they are of.
        pictures: how many came.
    """

    def __init__(self, socket: ClientConnection) -> None:
        self._socket, self._sequence = socket, 0
        self._stage: dict[str, Any] = {}
        self._axes: list[float] = []
        self._came = asyncio.Condition()
        self.frame: dict[str, Any] = {}
        self.frames = self.pictures = 0
        self.times: dict[str, list[float]] = {}

    async def __aenter__(self) -> Self:
        self._tasks = [asyncio.create_task(self._hear()), asyncio.create_task(self._say_always())]
        return self

    async def __aexit__(self, *_: object) -> None:
        for task in self._tasks:
            task.cancel()

    def begin(self) -> None:
        """Forget what was measured."""
        self.times = {"key to command": [], "key to page": [], "release to brake": [], "release to rest": []}
        self.times["round trip"] = []
        self.frames = self.pictures = 0

    async def ask(self, what: str) -> None:
        """Ask for something once."""
        await self._socket.send(json.dumps({"kind": "ask", "what": what, "value": True}))

    async def until(self, holds: Callable[[dict[str, Any]], bool]) -> float:
        """Wait for a frame of which something holds; return when it came [s]."""
        async with asyncio.timeout(_PATIENCE), self._came:
            await self._came.wait_for(lambda: bool(self.frame) and holds(self.frame))
        return time.monotonic()

    async def drive(self, seconds: float, rng: np.random.Generator) -> None:
        """Hold and let go for some time; where the robot has lost its input, begin anew."""
        end, sign = time.monotonic() + seconds, 1.0
        while time.monotonic() < end:
            sign = -sign
            await asyncio.sleep(rng.uniform(*_RESTS))
            pressed = await self._deflect(sign)
            came = await self.until(lambda frame: _speed(frame) > _MOVES)
            self.times["key to command"].append(self.frame["commanded"] - pressed)
            self.times["key to page"].append(came - pressed)
            await asyncio.sleep(_HOLDS)
            fastest = _speed(self.frame)
            released = await self._deflect(0.0)
            await self.until(lambda frame, most=fastest: _speed(frame) < most - _MOVES)
            self.times["release to brake"].append(self.frame["commanded"] - released)
            await self.until(lambda frame: _speed(frame) < _MOVES)
            self.times["release to rest"].append(self.frame["commanded"] - released)

    async def _deflect(self, value: float) -> float:
        """Push the base's stick; return when [s]."""
        self._axes = [0.0] * len(self._stage["channels"])
        self._axes[self._stage["channels"].index("base.vx")] = value
        now = time.monotonic()
        await self._say()
        return now

    async def _hear(self) -> None:
        async for message in self._socket:
            if isinstance(message, bytes):
                self.pictures += 1
                continue
            said = json.loads(message)
            if said["kind"] == "stage":
                self._stage = said["stage"]
                self._axes = self._axes or [0.0] * len(self._stage["channels"])
            elif said["kind"] == "frame":
                await self._take(said["frame"])

    async def _take(self, frame: dict[str, Any]) -> None:
        self.frames += 1
        async with self._came:
            self.frame = frame
            self._came.notify_all()
        await self._say()
        if frame["phase"] == "driving" and self.times:
            self.times["round trip"].append(frame["round_trip"])
        if frame["phase"] == "lost":
            self._axes = [0.0] * len(self._stage["channels"])

    async def _say_always(self) -> None:
        while True:
            await asyncio.sleep(_SAYS)
            await self._say()

    async def _say(self) -> None:
        """Say where the inputs are."""
        if not self._axes or not self.frame:
            return
        self._sequence += 1
        said = {"kind": "drive", "seq": self._sequence, "echo": self.frame["stamp"], "on": True}
        said |= {"device": "keyboard", "grip": False, "axes": self._axes, "view": 0.0, "targets": []}
        await self._socket.send(json.dumps(said))


def _speed(frame: dict[str, Any]) -> float:
    """Return how fast the base is commanded to go [m/s]."""
    return float(np.hypot(*frame["v"][:2]))

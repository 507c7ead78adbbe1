"""A connected page: gets what is newest of each kind, when it takes it; says a few messages at a time."""

import asyncio
import time
from collections.abc import Hashable

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

SLOW = 10.0  # time in which a page must take what it is sent [s]
REPLACED = 4001  # code of closing: the same page is open elsewhere
_MOST_MESSAGES = 150.0  # [1/s]
_MOST_AT_ONCE = 1000  # messages
_MOST_BAD, _MOST_TOO_FAST = 50, 3000  # messages before it is cut off


class PageSocket:
    """Holds the newest message of each kind until the page takes it.

    Args:
        socket: to the page.
        name: of the page, by which a reload is known.

    Attributes:
        sequence: of its last input.
        echo: the newest time of the server that it has answered [s].
        round_trip: how long that answer took [s].
        is_late: whether what it says comes too late to steer.
        bad: messages that made no sense.
        too_fast: messages beyond what it may say, since it was quiet.
    """

    def __init__(self, socket: WebSocket, name: str) -> None:
        self.socket, self.name = socket, name
        self.sequence, self.echo, self.round_trip, self.is_late = -1, 0.0, 0.0, False
        self.bad = self.too_fast = 0
        self._allowance, self._before = _MOST_MESSAGES, 0.0
        self._newest: dict[Hashable, str | bytes | int] = {}
        self._next: dict[Hashable, float] = {}
        self._waiting = asyncio.Event()
        self._coming = asyncio.ensure_future(socket.receive())

    @property
    def is_cut(self) -> bool:
        """Whether it has said too much that makes no sense, or far too much."""
        return self.bad >= _MOST_BAD or self.too_fast >= _MOST_TOO_FAST

    def may_say(self, now: float) -> bool:
        """Count a message; return whether it has said no more than so many a second [s]."""
        self._allowance = min(_MOST_MESSAGES, self._allowance + _MOST_MESSAGES * (now - self._before))
        self._before = now
        may = self._allowance >= 1.0
        self.too_fast = 0 if self._allowance == _MOST_MESSAGES else self.too_fast + (not may)
        self._allowance -= may
        return may

    async def hear(self) -> list[str | bytes]:
        """Return all that has come and was not heard yet, the oldest first; wait for it.

        Raises:
            WebSocketDisconnect: it is gone.
        """
        heard: list[str | bytes] = []
        while len(heard) < _MOST_AT_ONCE and (not heard or self._coming.done()):
            message = await self._coming
            if message["type"] == "websocket.disconnect":
                if heard:
                    break  # the next time
                raise WebSocketDisconnect
            heard.append(message.get("text") or message.get("bytes") or "")
            self._coming = asyncio.ensure_future(self.socket.receive())
            await asyncio.sleep(0)  # what is here already comes now
        return heard

    def end(self) -> None:
        """Hear no more."""
        self._coming.cancel()

    def offer(self, kind: Hashable, data: str | bytes | int, period: float = 0.0) -> None:
        """Let it have a message instead of an older one of its kind that still waits, one a period [s].

        A number is the code to close it with.
        """
        now = time.monotonic()
        if not period or now >= self._next.get(kind, 0.0):
            self._next[kind] = now + period
            self._newest[kind] = data
            self._waiting.set()

    def say(self, kind: str, **words: object) -> None:
        """Let it have a small message."""
        self.offer(kind, text(kind, **words))

    def answered(self, echo: float, now: float) -> None:
        """Take note of which time of the server it answers; the first answer to each one counts."""
        if echo > self.echo:
            self.echo, self.round_trip = echo, now - echo

    async def deliver(self) -> None:
        """Send what waits, for ever.

        Raises:
            TimeoutError: the page takes nothing.
        """
        while True:
            await self._waiting.wait()
            self._waiting.clear()
            while self._newest:
                kind = next(iter(self._newest))
                data = self._newest.pop(kind)
                send = self.socket.send_bytes if isinstance(data, bytes) else self.socket.send_text
                send = self.socket.close if isinstance(data, int) else send
                await asyncio.wait_for(send(data), SLOW)  # pyright: ignore[reportArgumentType]


def text(kind: str, **words: object) -> str:
    """Return a message as a page reads it."""
    return msgspec.json.encode({"kind": kind, **words}).decode()

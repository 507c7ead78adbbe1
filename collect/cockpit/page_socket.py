"""A connected page: gets what is newest of each kind, when it takes it."""

import asyncio
import json
from typing import Any

from starlette.websockets import WebSocket

SLOW = 10.0  # time in which a page must take what it is sent [s]
REPLACED = 4001  # code of closing: the same page is open elsewhere


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
    """

    def __init__(self, socket: WebSocket, name: str) -> None:
        self.socket, self.name = socket, name
        self.sequence, self.echo, self.round_trip, self.is_late = -1, 0.0, 0.0, False
        self._newest: dict[Any, str | bytes] = {}
        self._waiting = asyncio.Event()
        self._next: dict[Any, float] = {}

    def offer(self, kind: Any, data: str | bytes) -> None:
        """Let it have a message; an older one of its kind that still waits is dropped."""
        self._newest[kind] = data
        self._waiting.set()

    def offer_each(self, kind: Any, data: str | bytes, now: float, period: float) -> None:
        """Let it have a message of a kind of which it gets one a period [s]."""
        if now >= self._next.get(kind, 0.0):
            self._next[kind] = now + period
            self.offer(kind, data)

    def say(self, kind: str, **words: object) -> None:
        """Let it have a small message."""
        self.offer(kind, json.dumps({"kind": kind, **words}))

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
                socket = self.socket
                send = socket.send_bytes(data) if isinstance(data, bytes) else socket.send_text(data)
                await asyncio.wait_for(send, SLOW)

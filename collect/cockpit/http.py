"""HTTP connections that do not stay open without asking for anything, nor too many of them."""

import asyncio
import contextlib
import math
import socket
from collections.abc import Awaitable, Callable, Hashable
from functools import partial
from typing import ClassVar

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

_PATIENCE = 5.0  # until TLS is agreed on, and then until a request is whole [s]
_MOST, _MOST_ASKED = 64, 256  # connections that have not asked yet, and that have
_FULL = 0.1  # before another connection is taken where this process has no room for one [s]


class _Few:
    """What waits, in order of coming; the oldest of too many is cut, and whatever waits too long."""

    def __init__(self, most: int, patience: float = math.inf) -> None:
        self._most, self._patience = most, patience
        self._all: dict[Hashable, tuple[Callable[[], object], asyncio.TimerHandle]] = {}

    def add(self, waiting: Hashable, cut: Callable[[], object]) -> None:
        self._all[waiting] = cut, asyncio.get_running_loop().call_later(self._patience, cut)
        if len(self._all) > self._most:
            oldest, (cut, _) = next(iter(self._all.items()))
            self.remove(oldest)
            cut()

    def remove(self, waiting: Hashable) -> bool:
        """Return whether it was there."""
        found = self._all.pop(waiting, None)
        if found:
            found[1].cancel()
        return found is not None


class Http(H11Protocol):
    """A connection, until it is a page's socket."""

    _silent: ClassVar = _Few(_MOST, _PATIENCE)
    _asked: ClassVar = _Few(_MOST_ASKED)

    def connection_made(self, transport: asyncio.Transport) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Take note that it is open."""
        super().connection_made(transport)
        self._silent.add(self, transport.abort)

    def connection_lost(self, exc: Exception | None) -> None:
        """Take note that it is gone."""
        self._forget()
        super().connection_lost(exc)

    def handle_events(self) -> None:
        """Take what has come; a whole request ends the wait."""
        super().handle_events()
        if self not in self.connections:  # a page's socket by now, or gone
            self._forget()
        elif self.scope is not None and self._silent.remove(self):
            self._asked.add(self, self.transport.abort)

    def _forget(self) -> None:
        self._silent.remove(self)
        self._asked.remove(self)


class Server(uvicorn.Server):
    """Takes connections itself: asyncio would wait for TLS for a minute, with any number of strangers."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to take connections."""
        await super().startup(sockets=[])
        self._taking = [asyncio.create_task(self._take(each)) for each in sockets or ()]

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Take no more."""
        for each in self._taking:
            each.cancel()
        await super().shutdown(sockets)

    async def _take(self, listener: socket.socket) -> None:
        loop, coming = asyncio.get_running_loop(), _Few(_MOST)
        made = partial(Http, self.config, self.server_state, self.lifespan.state)
        patience = _PATIENCE if self.config.ssl else None
        listener.setblocking(False)
        while True:
            try:
                each, _ = await loop.sock_accept(listener)
            except OSError:
                await asyncio.sleep(_FULL)
                continue
            agreed = loop.connect_accepted_socket(
                made, each, ssl=self.config.ssl, ssl_handshake_timeout=patience
            )
            task = asyncio.create_task(_quietly(agreed))
            coming.add(task, task.cancel)
            task.add_done_callback(coming.remove)
            await asyncio.sleep(0)  # many that wait do not hold up all else


async def _quietly(agreed: Awaitable[object]) -> None:
    with contextlib.suppress(OSError):
        await agreed

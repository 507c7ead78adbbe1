"""HTTP connections that do not stay open without asking for anything."""

import asyncio
from typing import ClassVar

from uvicorn.protocols.http.h11_impl import H11Protocol

_PATIENCE = 5.0  # until a request is whole [s]
_MOST = 64  # connections that have not asked yet


class Http(H11Protocol):
    """A connection; cut if it does not ask within some seconds, or is the oldest of too many such ones."""

    _silent: ClassVar[dict["Http", asyncio.TimerHandle]] = {}

    def connection_made(self, transport: asyncio.Transport) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Take note that it is open."""
        super().connection_made(transport)
        self._silent[self] = self.loop.call_later(_PATIENCE, self._cut)
        while len(self._silent) > _MOST:
            next(iter(self._silent))._cut()

    def connection_lost(self, exc: Exception | None) -> None:
        """Take note that it is gone."""
        self._heard()
        super().connection_lost(exc)

    def handle_events(self) -> None:
        """Take what has come; a whole request ends the wait."""
        super().handle_events()
        if self.scope is not None or self not in self.connections:
            self._heard()

    def _heard(self) -> None:
        timer = self._silent.pop(self, None)
        if timer:
            timer.cancel()

    def _cut(self) -> None:
        self._heard()
        self.transport.abort()

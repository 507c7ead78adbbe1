"""Cards that cover the page, with something to read and questions: a channel beside the driving."""

import select
import time
from collections.abc import Mapping
from typing import Any

from handrail.collect.cockpit.messages import CardAnswer
from handrail.collect.cockpit.pipe import Kind
from handrail.collect.cockpit.process import ServerProcess

_PATIENCE = 0.1  # [s]
_AGAIN = 0.5  # after which a card is shown again: the web server may have been started anew [s]


class Cards:
    """Shows cards on the page of whoever drives, and hears what they answer.

    Only between episodes: the robot stands still then, and what devices say is not listened to.

    Args:
        server: of the page.
    """

    def __init__(self, server: ServerProcess) -> None:
        self._server, self._shown, self._at = server, {}, 0.0

    def show(self, card: Mapping[str, Any]) -> None:
        """Show a card instead of the one before; without an `id` it covers nothing."""
        if card != self._shown or time.monotonic() > self._at + _AGAIN:
            self._server.pipe.send_surely(Kind.CARD, card, (Kind.CARD,))
            self._shown, self._at = dict(card), time.monotonic()

    def hear(self) -> list[CardAnswer]:
        """Return what was answered, waiting a little for it; a STOP is left for the next episode."""
        select.select([self._server.pipe], [], [], _PATIENCE)
        messages = self._server.receive()
        self._server.unread = [each for each in messages if each[0] is Kind.STOP]
        return [CardAnswer(**value) for kind, value in messages if kind is Kind.ANSWER]

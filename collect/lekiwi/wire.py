"""A network that is late and loses messages, on purpose."""

from collections import deque

import numpy as np


class Wire[Message]:
    """Hands messages on some time later, in order; loses some.

    Args:
        latency: how much later [s].
        drop: share of the messages that it loses, 0 to 1.
        rng: says which.

    Attributes:
        lost: how many.
    """

    def __init__(self, latency: float, drop: float, rng: np.random.Generator) -> None:
        self._latency, self._drop, self._rng = latency, drop, rng
        self._on_the_way: deque[tuple[float, Message]] = deque()
        self.lost = 0

    def put(self, message: Message, now: float) -> None:
        """Take a message."""
        if self._rng.random() < self._drop:
            self.lost += 1
        else:
            self._on_the_way.append((now + self._latency, message))

    def newest(self, now: float) -> Message | None:
        """Return the newest message that has arrived since the last time; those before it are forgotten."""
        message = None
        while self._on_the_way and self._on_the_way[0][0] <= now:
            _, message = self._on_the_way.popleft()
        return message

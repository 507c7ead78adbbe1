"""The lease: one page drives at a time; the others watch, and may ask for it."""

import math
import time
from collections.abc import Callable

RESERVED = 5.0  # how long a page that was cut off may come back to its lease [s]


class Lease:
    """Says which page drives.

    Attributes:
        holder: the page that drives, by its own name; empty for none.
        asking: the page that asked for it last; empty for none.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.holder = self.asking = ""
        self._clock, self._ends = clock, math.inf  # for whoever left; never while the holder is there [s]

    def take(self, page: str) -> None:
        """Let a page drive if nobody does, or it drove a moment ago; else take note that it asks."""
        if not self.is_free_for(page):
            self.asking = page
            return
        self.holder, self._ends = page, math.inf
        self.asking = "" if self.asking == page else self.asking

    def is_free_for(self, page: str) -> bool:
        """Whether a page may drive at once."""
        return page == self.holder or not self.holder or self._clock() > self._ends

    def give(self, page: str) -> None:
        """Let whoever asks drive instead of a page, or nobody."""
        if page == self.holder:
            self.holder, self.asking, self._ends = self.asking, "", math.inf

    def leave(self, page: str) -> None:
        """Take note that a page is gone; for a moment it may come back."""
        if page == self.holder:
            self._ends = self._clock() + RESERVED
        if page == self.asking:
            self.asking = ""

    def settle(self) -> None:
        """Let whoever asks drive if nobody does any more."""
        if self.asking and self.is_free_for(self.asking):
            self.take(self.asking)

    def drives(self, page: str) -> bool:
        """Whether it is this page that drives."""
        return page == self.holder and self._ends == math.inf

"""Ctrl-C and SIGTERM while something is recorded or run."""

import contextlib
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType
from typing import Self

_AGAIN = 0.01  # time after which an interrupt comes again [s]


class Interrupts:
    """Ends what runs on Ctrl-C or SIGTERM: at once between saves, after it during one.

    Outside of the main thread, which alone hears signals, it changes nothing.

    Attributes:
        asked: whether an interrupt has come.
    """

    _SIGNALS = (signal.SIGINT, signal.SIGTERM)

    def __enter__(self) -> Self:
        self._deferring = self.asked = False
        hears = threading.current_thread() is threading.main_thread()
        signals = self._SIGNALS if hears else ()
        self._previous = {number: signal.signal(number, self._interrupt) for number in signals}
        self._unraisable, sys.unraisablehook = sys.unraisablehook, self._again
        return self

    def __exit__(self, kind: type[BaseException] | None = None, *_: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)
        sys.unraisablehook = self._unraisable
        if self.asked and (outer := _current()):
            outer.asked = True
        if self.asked and kind in (SystemError, TypeError):  # a compiled library made it of the interrupt
            raise KeyboardInterrupt

    @contextlib.contextmanager
    def deferred(self) -> Iterator[None]:
        """Let the block finish before an interrupt takes effect."""
        self._deferring = True
        try:
            yield
        finally:
            self._deferring = False
        if self.asked:
            raise KeyboardInterrupt

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        if not self._deferring:
            raise KeyboardInterrupt

    def _again(self, lost: "sys.UnraisableHookArgs") -> None:
        """Let an interrupt come again that was raised in a destructor or callback: Python drops it there."""
        if issubclass(lost.exc_type, KeyboardInterrupt):
            main = threading.main_thread().ident
            threading.Timer(_AGAIN, signal.pthread_kill, (main, signal.SIGINT)).start()
        else:
            self._unraisable(lost)


def interrupted() -> bool:
    """Return whether an interrupt has come: a library that is imported just then makes other errors of it."""
    current = _current()
    return current is not None and current.asked


def _current() -> Interrupts | None:
    """Return what hears the signals now."""
    owner = getattr(signal.getsignal(signal.SIGTERM), "__self__", None)
    return owner if isinstance(owner, Interrupts) else None

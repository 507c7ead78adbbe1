"""The terminal that a command was started in: key by key, nothing echoed, put back as it was."""

import atexit
import contextlib
import os
import select
import sys

from handrail.collect.devices.reading import DeviceGoneError
from handrail.controllers.errors import message_of

_AT_ONCE = 4096  # bytes
_KEYS_BEGIN = b"\x1b[>11u"  # kitty's keyboard protocol: every key, when it goes down and up
_KEYS_END = b"\x1b[<u"
_FOCUS_BEGIN, _FOCUS_END = b"\x1b[?1004h", b"\x1b[?1004l"  # the terminal says when it is left
WHICH_KEYS = b"\x1b[?u\x1b[c"  # whether it has that protocol; every terminal answers the second one
ARE_YOU_THERE = b"\x1b[5n"


def has_terminal() -> bool:
    """Return whether there is a terminal that belongs to this program now."""
    try:
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except (OSError, ValueError, AttributeError):
        return False


class KeyTerminal:
    """The terminal of standard input."""

    def __init__(self) -> None:
        self._file = -1
        self._tells_releases = False

    def open(self) -> None:
        """Take it.

        Raises:
            DeviceGoneError: there is none, or it belongs to another program now.
        """
        try:
            import termios
            import tty
        except ImportError as error:  # Windows
            raise DeviceGoneError(
                "keyboard: expected a terminal of Linux or macOS; say --operator browser"
            ) from error
        try:
            self._file = os.open(os.ttyname(sys.stdin.fileno()), os.O_RDWR | os.O_NOCTTY)
        except (OSError, ValueError, AttributeError) as error:
            raise DeviceGoneError(
                "keyboard: expected a terminal to read keys from, found none; start it in a terminal without "
                "a pipe or &, or say --operator browser"
            ) from error
        if not has_terminal():
            self._forget()
            raise DeviceGoneError("keyboard: this runs in the background (&); bring it to the front with fg")
        self._before = termios.tcgetattr(self._file)
        tty.setcbreak(self._file)
        quiet = termios.tcgetattr(self._file)
        quiet[0] &= ~(termios.IXON | termios.ICRNL)  # Ctrl-S does not freeze it
        quiet[6][termios.VSUSP] = b"\0"  # Ctrl-Z does not suspend a robot that moves
        termios.tcsetattr(self._file, termios.TCSANOW, quiet)
        atexit.register(self.close)
        self.write(_FOCUS_BEGIN + WHICH_KEYS)

    def tell_releases(self) -> None:
        """Let it tell also when keys go up."""
        self._tells_releases = True
        self.write(_KEYS_BEGIN)

    def read(self, patience: float) -> bytes:
        """Return what came, after some time at most [s].

        Raises:
            DeviceGoneError: it was closed.
        """
        try:
            ready, _, _ = select.select([self._file], [], [], patience)
            data = os.read(self._file, _AT_ONCE) if ready else None
        except (OSError, ValueError) as error:
            raise DeviceGoneError(f"keyboard: the terminal is gone ({message_of(error)})") from error
        if data == b"":
            raise DeviceGoneError("keyboard: the terminal was closed")
        return data or b""

    def write(self, data: bytes) -> None:
        """Say something to the terminal itself; one that is gone shows at the next reading."""
        with contextlib.suppress(OSError):
            os.write(self._file, data)

    def close(self) -> None:
        """Put it back as it was."""
        if self._file < 0:
            return
        import termios

        self.write((_KEYS_END if self._tells_releases else b"") + _FOCUS_END)
        with contextlib.suppress(termios.error):
            termios.tcsetattr(self._file, termios.TCSAFLUSH, self._before)
        self._forget()
        atexit.unregister(self.close)

    def _forget(self) -> None:
        os.close(self._file)
        self._file, self._tells_releases = -1, False

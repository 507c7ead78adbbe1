"""The keys of a terminal, also over ssh: held while they are down, or while the terminal repeats them."""

import _thread
import atexit
import contextlib
import os
import select
import sys
import termios
import time
import tty
from collections.abc import Callable, Collection
from dataclasses import dataclass, field

from handrail.collect.devices.device import DeviceInput
from handrail.collect.devices.key_bytes import (
    FOCUS_IN,
    FOCUS_OUT,
    INTERRUPT,
    TELLS_RELEASES,
    THERE,
    Key,
    KeyBytes,
)
from handrail.controllers.errors import HandrailError

HELD = 0.2  # after its last character, a key of a terminal that does not tell releases counts as let go [s]
_AGAIN = 0.7  # what comes earlier is a repetition, whose first one comes after 0.25 to 0.66 s [s]
_ASKS = 0.05  # a terminal is asked that often whether it is there [s]
_SILENCE = 0.15  # without an answer, nobody is there [s]
_WAIT = 0.008  # for keys [s]
_AT_ONCE = 4096  # bytes
_IN_BETWEEN = {"TMUX", "STY", "ZELLIJ"}  # variables of programs that answer in a terminal's place
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
    """The terminal of standard input.

    Attributes:
        tells_releases: whether it tells also when keys go up.
    """

    def __init__(self) -> None:
        self._file, self.tells_releases = -1, False

    def open(self) -> None:
        """Take it."""
        try:
            self._file = os.open(os.ttyname(sys.stdin.fileno()), os.O_RDWR | os.O_NOCTTY)
        except (OSError, ValueError, AttributeError) as error:
            raise HandrailError(
                "keyboard: expected a terminal to read keys from, found none; start it in a terminal without "
                "a pipe or &, or say --operator browser"
            ) from error
        if not has_terminal():
            self._forget()
            raise HandrailError("keyboard: this runs in the background (&); bring it to the front with fg")
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
        self.tells_releases = True
        self.write(_KEYS_BEGIN)

    def read(self, patience: float) -> bytes:
        """Return what came, after some time at most [s]."""
        ready, _, _ = select.select([self._file], [], [], patience)
        data = os.read(self._file, _AT_ONCE) if ready else None
        if data == b"":
            raise HandrailError("keyboard: the terminal was closed")
        return data or b""

    def write(self, data: bytes) -> None:
        """Say something to the terminal itself; one that is gone shows at the next reading."""
        with contextlib.suppress(OSError):
            os.write(self._file, data)

    def close(self) -> None:
        """Put it back as it was."""
        if self._file < 0:
            return
        self.write((_KEYS_END if self.tells_releases else b"") + _FOCUS_END)
        select.select([self._file], [], [], _SILENCE)  # what was asked is answered, and thrown away
        with contextlib.suppress(termios.error):
            termios.tcsetattr(self._file, termios.TCSAFLUSH, self._before)
        self._forget()
        atexit.unregister(self.close)

    def _forget(self) -> None:
        os.close(self._file)
        self._file, self.tells_releases = -1, False


@dataclass
class Keyboard:
    """The keys of a terminal; a device.

    Most terminals tell only characters: a key that is held comes again and again, the first time after about
    half a second. A key counts as held for 0.2 s after each. Terminals with kitty's keyboard protocol tell
    when keys go up; these are asked 20 times a second whether they are still there, so that a connection that
    hangs is no key that is held. So is every terminal beside something else that moves the robot.

    Args:
        terminal: the one to read.
        clock: of readings [s].
        stops: keys of the emergency stop: no rule keeps them back.
        supervises: whether something else moves the robot while nothing is held.
    """

    terminal: KeyTerminal = field(default_factory=KeyTerminal)
    clock: Callable[[], float] = time.monotonic
    stops: Collection[str] = ("space",)
    supervises: bool = False
    name = "keyboard"

    def open(self) -> None:
        """Take the terminal."""
        self._bytes = KeyBytes(self.stops)
        self._held: dict[str, float] = {}
        self._last = "", 0.0  # key that came, and when [s]
        self._in_focus = True
        self._heard = self._asked = self._round_trip = 0.0
        self._waits = False  # for an answer
        if self.supervises and _IN_BETWEEN & os.environ.keys():
            raise HandrailError(
                "keyboard beside --policy: expected a terminal itself, got tmux or the like; start it outside"
            )
        self.terminal.open()

    def read(self) -> DeviceInput:
        """Return the keys that are held."""
        data = self.terminal.read(_WAIT)
        now = self.clock()
        if data and self._waits:
            self._round_trip, self._waits = now - self._asked, False
        self._heard = now if data else self._heard
        presses = [key.name for key in self._bytes.take(data, now) if self._takes(key, now)]
        if not self.terminal.tells_releases:
            self._held = {name: since for name, since in self._held.items() if now - since <= HELD}
        asks = self.supervises or (self.terminal.tells_releases and bool(self._held))
        silent = asks and self._is_silent(now)
        return DeviceInput(
            self._heard if silent else now,
            dict.fromkeys(self._held, 1.0),
            tuple(presses),
            attended=self._in_focus and not silent,
            round_trip=self._round_trip,
        )

    def close(self) -> None:
        """Put the terminal back as it was."""
        self.terminal.close()

    def _takes(self, key: Key, now: float) -> bool:
        """Take a key; return whether it was pressed now."""
        if key.name == INTERRUPT:
            _thread.interrupt_main()
        elif key.name == TELLS_RELEASES:
            self.terminal.tell_releases()
        elif key.name in (FOCUS_IN, FOCUS_OUT):
            self._in_focus = key.name == FOCUS_IN
            self._held.clear()
        elif key.change == "up":
            self._held.pop(key.name, None)
        elif key.name != THERE:
            last, before = self._last
            self._last, self._held[key.name] = (key.name, now), now
            again = not self.terminal.tells_releases and key.name == last and now - before < _AGAIN
            return key.name in self.stops or (key.change == "down" and not again)
        return False

    def _is_silent(self, now: float) -> bool:
        """Whether the terminal does not answer any more; ask it."""
        if not self._waits and now - self._asked >= _ASKS:
            self._asked, self._waits = now, True
            self.terminal.write(ARE_YOU_THERE)
        return self._waits and now - self._asked > _SILENCE

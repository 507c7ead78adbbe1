"""A command in a terminal of its own, and a player who sees what the terminal shows and presses keys."""

import fcntl
import os
import pty
import re
import select
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

_SIZE = struct.pack("HHHH", 50, 120, 0, 0)
_REPEAT = 0.033  # of a key that is held, as terminals do [s]
_SEQUENCES = re.compile(r"\x1b\[[0-9;?<>]*[a-zA-Z]")
_WAY = re.compile(
    r"forward ([+-][\d.]+), left ([+-][\d.]+), up ([+-][\d.]+), "
    r"roll ([+-][\d.]+), tip ([+-][\d.]+), turn ([+-][\d.]+)"
)
_KEYS = ("ws", "ad", "rf", "xz", "gt", "qe")  # one way along each, and the other
_NEAR = (0.03, 0.03, 0.03, 0.08, 0.08, 0.08)  # [m, rad]


class TerminalPlayer:
    """Starts `handrail-<name>` in a pseudo terminal."""

    def __init__(self, *arguments: str, name: str = "record") -> None:
        self._master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, _SIZE)
        command = [sys.executable, "-m", "handrail.scripts", name, *arguments]
        self._child = subprocess.Popen(
            command, stdin=slave, stdout=slave, stderr=slave, preexec_fn=own_terminal
        )
        os.close(slave)
        self._said = ""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._child.kill()
        self._child.wait()
        os.close(self._master)

    def press(self, keys: str) -> None:
        """Press keys, or say the bytes of one."""
        os.write(self._master, keys.encode())

    def until(self, shown: str, patience: float = 60.0) -> None:
        """Wait until the terminal shows some words anew."""
        self._said = ""
        self._watch(lambda: shown in self._said, patience)

    def ended(self, patience: float = 60.0) -> int:
        """Wait until the command ends; return its exit code."""
        self._watch(lambda: self._child.poll() is not None, patience)
        return self._child.wait()

    def go_to_the_goal(self, patience: float = 60.0) -> None:
        """Hold one key after the other, as the way that is shown says, until the episode is over."""
        self._said = ""

        def step() -> bool:
            if way := _WAY.findall(self._said):
                self._said = self._said[-4000:]
                left = [float(number) for number in way[-1]]
                worst = max(range(6), key=lambda axis: abs(left[axis]) / _NEAR[axis])
                self.press(_KEYS[worst][left[worst] < 0])
            return "last episode saved" in self._said

        self._watch(step, patience, _REPEAT)

    def _watch(self, step: Callable[[], bool], patience: float, period: float = 0.02) -> None:
        end = time.monotonic() + patience
        while not step():
            assert time.monotonic() < end, self._said[-3000:]
            ready, _, _ = select.select([self._master], [], [], period)
            if ready:
                try:
                    data = os.read(self._master, 65536)
                except OSError:  # the command has ended
                    data = b""
                self._said += _SEQUENCES.sub("", data.decode(errors="replace"))
            time.sleep(period)


def own_terminal() -> None:
    os.setsid()
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)

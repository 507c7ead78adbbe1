"""Kills a recording at its k-th change to the disk, for every k.

An audit hook sees each `open` for writing, rename, removal and new folder before it happens. At the k-th one
it raises `Killed`, which no handler catches, and from then on refuses every change: what is on the disk is
what a killed process would have left, files half written in the staging folder included.
"""

import gc
import os
import signal
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

CHANGES = ("os.rename", "os.link", "os.symlink", "os.remove", "os.mkdir", "os.rmdir", "os.truncate")
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT


class Killed(BaseException):
    """The process is no more."""


class Guillotine:
    """Counts changes below one folder and refuses all from the k-th on."""

    def __init__(self):
        self._root, self._left, self.dead = "", 0, False
        sys.addaudithook(self._audit)

    def run(self, root: Path, k: int, script: Callable[[], object]) -> bool:
        """Run a script and kill it at its k-th change; return whether it lived to its end."""
        self._root, self._left, self.dead = str(root), k, False
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)
            lived = self._survives(script)
            self._root = ""
            gc.collect()  # a dead process holds no lock
        return lived

    def _survives(self, script: Callable[[], object]) -> bool:
        try:
            script()
        except Killed:
            return False
        return not self.dead

    def _audit(self, event: str, arguments: tuple) -> None:
        if not self._root or not is_change(event, arguments, self._root):
            return
        self._left -= 1
        if self._left <= 0:
            self.dead = True
            raise Killed


def is_change(event: str, arguments: tuple, folder: str) -> bool:
    """Return whether an event is a change to what lies at a path that begins so."""
    if event not in CHANGES and not (event == "open" and bool((arguments[2] or 0) & WRITING)):
        return False
    paths = [os.fspath(path) for path in arguments[:2] if isinstance(path, str | os.PathLike)]
    return any(path.startswith(folder) for path in paths)


def kill_at(folder: str, k: int) -> list[str]:
    """Kill this process, with SIGKILL, at its k-th change; return a list to which each change is added."""
    changes: list[str] = []

    def audit(event: str, arguments: tuple) -> None:
        if is_change(event, arguments, folder):
            changes.append(event)
            if len(changes) == k:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(audit)
    return changes


def tear_staged_files(root: Path) -> None:
    """Cut every staged file in half: what a killed process leaves there need not be whole."""
    for path in (root / ".handrail").glob("*"):
        if path.is_file() and path.stat().st_size:
            os.truncate(path, path.stat().st_size // 2)

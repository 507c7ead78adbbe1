"""One writer a folder, such as a dataset: an advisory lock that dies with its process."""

import contextlib
import fcntl
import os
from pathlib import Path
from typing import BinaryIO, Self

from handrail.controllers.errors import HandrailError
from handrail.datasets.storage.atomic import make_folder

LOCK_NAME = "lock"
_FLAGS = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NONBLOCK  # a named pipe would wait
_TRIES = 1000  # to take it while others give it back


class HeldError(HandrailError):
    """Somebody else has the right to change it."""


class FolderLock:
    """The right to change one folder, held from construction to `release`."""

    def __init__(self, staging: Path, thing: str = "", holder: str = "recorder", existing: bool = False):
        """Take the lock.

        Args:
            staging: The folder of the lock's file; created if missing.
            thing: The locked thing, in words and with its name; empty for the dataset that the folder is in.
            holder: The program that may hold it, in words.
            existing: Whether the folder of `staging` must be there; if not, a writing anew is renaming it.

        Raises:
            HeldError: Another process, or another writer in this one, holds it.
            OSError: The folder cannot be written.
        """
        self._path = staging / LOCK_NAME
        self._thing, self._holder = thing or f"dataset {str(staging.parent)!r}", holder
        self._file: BinaryIO | None = self._acquire(existing)

    def release(self) -> None:
        """Give the lock back and remove the staging folder if nothing else is in it; safe to call twice."""
        if self._file is None:
            return
        file, self._file = self._file, None
        with file:
            mine = self._is_current(file)  # else the folder was replaced by somebody else's
            if mine:
                self._path.unlink()
        if mine:
            with contextlib.suppress(OSError):  # something else is in it (NFS: until the file is closed)
                self._path.parent.rmdir()

    def moved(self, staging: Path) -> None:
        """Take note of where the locked staging folder is since its dataset was renamed."""
        self._path = staging / LOCK_NAME

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def _acquire(self, existing: bool) -> BinaryIO:
        folder = self._path.parent
        held = HeldError(
            f"{self._thing} is being written by another {self._holder}: expected to be the only one;"
            " close the other, or choose another name"
        )
        for _ in range(_TRIES):
            with contextlib.suppress(
                FileNotFoundError, FileExistsError
            ):  # the last holder has just removed the folder
                folder.mkdir(exist_ok=True) if existing else make_folder(folder)
                file = open(os.open(self._path, _FLAGS, 0o666), "ab")  # noqa: SIM115 - open while it is held
                try:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except OSError as error:
                    file.close()
                    raise held from error
                if self._is_current(file):
                    return file
                file.close()
        if not existing or folder.parent.is_dir():
            make_folder(folder)  # says why there is none
        raise held

    def _is_current(self, file: BinaryIO) -> bool:
        """Return whether the locked file is still the one with the lock's name (its owner removes it)."""
        try:
            return os.path.samestat(os.fstat(file.fileno()), self._path.stat())
        except FileNotFoundError:
            return False

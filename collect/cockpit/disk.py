"""The room that is left for episodes: measured beside the loop that drives, which waits for no disk."""

import shutil
import threading
from pathlib import Path

_PERIOD = 5.0  # between two looks [s]


class DiskWatch:
    """Looks every few seconds, in a thread of its own, at a dataset's folder; it need not exist yet.

    Attributes:
        left: free [bytes], and about how many episodes that is; -1 where it is unknown.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._saved, self.left = folder, 0, (-1, -1)
        self._before = self._used = self._walked = -1
        self._is_over, self._again = False, threading.Event()
        self._thread = threading.Thread(target=self._watch, name="disk", daemon=True)
        self._thread.start()

    def saved(self, episodes: int) -> None:
        """Take note of how many episodes were saved since this began."""
        self._saved = episodes
        self._again.set()

    def close(self) -> None:
        """Look no more."""
        self._is_over = True
        self._again.set()
        self._thread.join(1.0)  # a disk that hangs does not keep the recording from ending

    def _watch(self) -> None:
        while not self._is_over:
            self._look()
            self._again.wait(_PERIOD)
            self._again.clear()

    def _look(self) -> None:
        saved = self._saved
        try:
            place = next(each for each in (self._folder, *self._folder.parents) if each.is_dir())
            free = shutil.disk_usage(place).free
            if saved != self._walked:
                files = [file for file in self._folder.rglob("*") if file.is_file()]
                self._used, self._walked = sum(file.stat().st_size for file in files), saved
                self._before = self._used if self._before < 0 else self._before
        except (OSError, StopIteration):  # it is gone, or a file of it was, between two looks
            return
        grown = self._used - self._before
        self.left = free, int(free * saved / grown) if grown > 0 else -1

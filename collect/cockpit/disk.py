"""The room that is left on the disk, in episodes."""

import shutil
from contextlib import suppress
from pathlib import Path


class DiskRoom:
    """Measures a dataset's folder, which need not exist yet; between episodes, when no loop waits.

    Attributes:
        left: free [bytes], and about how many episodes that is; -1 where it is unknown.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._before, self.left = folder, -1, (-1, -1)
        self.measure(0)

    def measure(self, saved: int) -> None:
        """Look how much is left after so many episodes were saved since this began."""
        with suppress(OSError):  # a file was gone between two looks
            place = next(each for each in (self._folder, *self._folder.parents) if each.is_dir())
            used = sum(file.stat().st_size for file in self._folder.rglob("*") if file.is_file())
            self._before = used if self._before < 0 else self._before
            free, grown = shutil.disk_usage(place).free, used - self._before
            self.left = free, int(free * saved / grown) if grown > 0 else -1

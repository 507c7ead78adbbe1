"""SHA-256 of a dataset's files, remembered from one time to the next by size and time of change.

Hashing takes a second a gigabyte, so it is done once: before training and comparison nothing is read that has
not changed since. A disk that rots changes neither size nor time; `anew` reads every byte.
"""

import contextlib
import hashlib
import json
import os
from pathlib import Path
from typing import Any

from handrail.controllers.user_folder import user_folder
from handrail.datasets.format.metadata import Checksum
from handrail.datasets.storage.atomic import write_whole
from handrail.datasets.storage.strict_json import known_json


class Checksums:
    """Checksums of files below one folder; with `anew` every file is read, whatever is remembered."""

    def __init__(self, root: Path, anew: bool = False):
        """See the class."""
        self._root = root
        name = hashlib.sha256(os.path.realpath(root).encode()).hexdigest()[:24]
        self._memory = memory_folder() / f"{name}.json"
        self._known = {} if anew else known_json(self._memory)
        self._used: dict[str, Any] = {}

    def of(self, path: Path) -> Checksum:
        """Return the checksum of a file, read only where it has changed.

        Raises:
            OSError: It is not there or cannot be read.
        """
        name, found = str(path.relative_to(self._root)), path.stat()
        state = [found.st_size, found.st_mtime_ns, found.st_ctime_ns]
        known = self._known.get(name)
        if not (isinstance(known, list) and known[:-1] == state and isinstance(known[-1], str)):
            known = [*state, Checksum.of(path).sha256]
        self._used[name] = known
        return Checksum(found.st_size, known[-1])

    def remember(self) -> None:
        """Keep what was found for the next time; a full disk or a read-only home is no error."""
        with contextlib.suppress(OSError):
            write_whole(self._memory, json.dumps(self._used).encode())


def memory_folder() -> Path:
    """Return where it is kept what was checked, and when."""
    return user_folder("XDG_CACHE_HOME") / "checksums"

"""The episodes of this run: how they went, the poses of the newest for pages to play again, room for more.

A file of poses is `n` (uint32) and `n` bytes of JSON, filled up with blanks to whole words, then float32
numbers: in every row the time [s] and where each body is, position [m] and quaternion (wxyz).
"""

import hashlib
import json
import shutil
import struct
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from handrail.collect.cockpit import stage
from handrail.collect.cockpit.process import ServerProcess
from handrail.collect.session.outcome import Outcome
from handrail.collect.world.gl import MjData, MjModel
from handrail.controllers.arrays import FloatArray

_PERIOD = 0.1  # between two rows [s]
_MOST_FILES, _MOST_BYTES = 50, 64 * 2**20  # that are kept
_WORD = 4  # [bytes]


class EpisodePoses:
    """Takes the poses along an episode, in the scene of a compiled model."""

    def __init__(self, model: MjModel) -> None:
        self._model = model
        self._rows: list[tuple[int, FloatArray]] = []

    def see(self, number: int, data: MjData) -> None:
        """Take a frame's moment, unless the last one was just now.

        After an undo a number has been there before: that moment is forgotten.
        """
        while self._rows and self._rows[-1][0] >= number:
            self._rows.pop()
        if not self._rows or data.time >= self._rows[-1][1][0] + 0.99 * _PERIOD:
            row = np.concatenate([[data.time], np.hstack([data.xpos, data.xquat]).ravel()])
            self._rows.append((number, row.astype("<f4")))

    def file(self) -> bytes:
        """Return all of it."""
        said: dict[str, Any] = {"shapes": stage.shapes(self._model), "meshes": stage.meshes(self._model)[0]}
        header = json.dumps(said, separators=(",", ":")).encode()
        header += b" " * (-len(header) % _WORD)
        return struct.pack("<I", len(header)) + header + b"".join(row.tobytes() for _, row in self._rows)


class EpisodeList:
    """Counts episodes, and keeps the newest poses where the page's server finds them."""

    def __init__(self, server: ServerProcess) -> None:
        self._server = server
        self.saved = self.succeeded = 0
        self._said: list[dict[str, Any]] = []
        self._sizes: dict[str, int] = {}  # of the files that are kept

    def add(self, outcome: Outcome, poses: EpisodePoses) -> None:
        """Count an episode; keep its poses, if it is kept."""
        self.saved += outcome.kept
        self.succeeded += outcome.kept and outcome.success
        reason = outcome.failure_reason.replace("_", " ") or str(outcome.ended_by)
        words = "success" if outcome.success else reason
        words += "; you said done" if outcome.operator_says == "success" and not outcome.success else ""
        words = f"practice: {words}" if outcome.practice else words
        said = {"kept": outcome.kept, "success": outcome.success, "said": words, "seconds": outcome.seconds}
        self._said.append(said | {"played": self._keep(poses.file()) if outcome.kept else ""})

    def described(self) -> list[dict[str, Any]]:
        """Return how each episode went, with the name of its poses while they are there."""
        return [each | {"played": each["played"] * (each["played"] in self._sizes)} for each in self._said]

    def _keep(self, data: bytes) -> str:
        """Keep a file, for older ones if there is no room; return its name, which says what is in it."""
        name = f"{hashlib.sha256(data).hexdigest()[:24]}.bin"
        self._server.keep(name, data)
        self._sizes[name] = len(data)
        while len(self._sizes) > _MOST_FILES or sum(self._sizes.values()) > _MOST_BYTES:
            oldest = next(iter(self._sizes))
            del self._sizes[oldest]
            self._server.drop(oldest)
        return name


class DiskRoom:
    """Measures the room that is left for episodes, in a folder that need not exist yet; when no loop waits.

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

"""The poses of an episode as they were, for pages to play them again.

A file is `n` (uint32) and `n` bytes of JSON, filled up with blanks to whole words, then float32 numbers: in
every row the time [s] and where each body is, position [m] and quaternion (wxyz).
"""

import hashlib
import json
import struct
from collections import OrderedDict
from collections.abc import Callable
from typing import Any

import numpy as np

from handrail.collect.cockpit import stage
from handrail.collect.world.gl import MjData, MjModel
from handrail.controllers.arrays import FloatArray

_PERIOD = 0.1  # between two rows [s]
_MOST_FILES, _MOST_BYTES = 50, 64 * 2**20  # that are kept
_WORD = 4  # [bytes]


class EpisodePoses:
    """Takes the poses along an episode.

    Args:
        model: the compiled model of its scene.
    """

    def __init__(self, model: MjModel) -> None:
        self._model = model
        self._rows: list[tuple[int, FloatArray]] = []

    def see(self, number: int, data: MjData) -> None:
        """Take a moment, unless the last one was just now.

        Args:
            number: of the frame; after an undo it has been there before, and what that was is forgotten.
            data: the state of the simulation.
        """
        while self._rows and self._rows[-1][0] >= number:
            self._rows.pop()
        if self._rows and data.time < self._rows[-1][1][0] + 0.99 * _PERIOD:
            return
        row = np.concatenate([[data.time], np.hstack([data.xpos, data.xquat]).ravel()])
        self._rows.append((number, row.astype("<f4")))

    def file(self) -> bytes:
        """Return all of it."""
        said: dict[str, Any] = {"shapes": stage.shapes(self._model), "meshes": stage.meshes(self._model)[0]}
        header = json.dumps(said, separators=(",", ":")).encode()
        header += b" " * (-len(header) % _WORD)
        return struct.pack("<I", len(header)) + header + b"".join(row.tobytes() for _, row in self._rows)


class PlayedFiles:
    """Keeps the newest episodes' files where the page's server finds them.

    Args:
        keep: lets the server have a file.
        drop: takes one away from it.
    """

    def __init__(self, keep: Callable[[str, bytes], None], drop: Callable[[str], None]) -> None:
        self._keep, self._drop = keep, drop
        self._sizes: OrderedDict[str, int] = OrderedDict()

    def add(self, data: bytes) -> str:
        """Keep a file; return its name, which says what is in it."""
        name = f"{hashlib.sha256(data).hexdigest()[:24]}.bin"
        self._keep(name, data)
        self._sizes[name] = len(data)
        while len(self._sizes) > _MOST_FILES or sum(self._sizes.values()) > _MOST_BYTES:
            self._drop(self._sizes.popitem(last=False)[0])
        return name

    def __contains__(self, name: str) -> bool:
        """Whether a file is still there."""
        return name in self._sizes

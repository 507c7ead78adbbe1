"""A dataset's metadata of its episodes: one row an episode, and their totals.

Beside LeRobot's own, a row has extra columns: success, operator, seed and whatever else a session knows. The
first saved episode fixes which there are and their types: one parquet schema for all episodes. Strings are
never null (None becomes ""); other columns may be left out later.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import numpy as np
import pyarrow as pa

from handrail.controllers.errors import HandrailError
from handrail.controllers.regular_file import open_regular
from handrail.datasets.format.stats import Stats, merge_stats

Scalar = str | bool | int | float
ColumnTypes = dict[str, pa.DataType]
CLIENT = "robot_client"  # which of LeRobot's robots was driven through its client; empty or missing for none
_RESERVED = ("episode_index", "tasks", "length", "dataset_from_index", "dataset_to_index")
_TYPES: dict[type, pa.DataType] = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.string()}


@dataclass(frozen=True)
class Checksum:
    """Size [byte] and SHA-256 of a file at the moment its episode was saved."""

    size: int
    sha256: str

    @classmethod
    def of(cls, path: Path) -> "Checksum":
        """Return the checksum of a file.

        Raises:
            OSError: The file cannot be read.
        """
        with open_regular(path) as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        return cls(path.stat().st_size, digest)


@dataclass(frozen=True)
class EpisodeRecord:
    """The row of metadata of one episode."""

    episode: int
    """Its number."""
    start: int
    """Index of its first frame in the dataset."""
    length: int
    """Number of frames."""
    tasks: tuple[str, ...]
    """Its task sentences, in the order in which they first occur."""
    stats: Stats | None
    """Statistics of its columns; None where they were not read."""
    columns: Mapping[str, Scalar | None]
    """Extra columns."""
    files: Mapping[str, Checksum]
    """Checksums of its data and video files by relative path."""
    file_index: int
    """The first episode in its files, after which these are named."""
    offset: int = 0
    """How many frames in its files are before it."""


@dataclass(frozen=True)
class Totals:
    """The totals of the episodes."""

    episodes: int = 0
    frames: int = 0
    tasks: tuple[str, ...] = ()
    """Task sentences; the place is the `task_index`."""
    stats: Stats | None = field(default=None, compare=False)
    """Statistics over all frames."""

    def with_tasks(self, tasks: tuple[str, ...]) -> tuple[str, ...]:
        """Return the task sentences after an episode: new ones are appended in their order."""
        return tuple(dict.fromkeys((*self.tasks, *tasks)))

    def grown(self, record: EpisodeRecord) -> "Totals":
        """Return the totals with one more episode."""
        stats = self.stats if record.stats is None else merge_stats(self.stats, record.stats)
        return Totals(self.episodes + 1, self.frames + record.length, self.with_tasks(record.tasks), stats)


def is_extra(column: str) -> bool:
    """Return whether a column of `meta/episodes` is none of LeRobot's own."""
    return "/" not in column and column not in _RESERVED


def plain_columns(columns: Mapping[str, object]) -> dict[str, Scalar]:
    """Return extra columns with plain Python values."""
    found: dict[str, Scalar] = {}
    for name, value in columns.items():
        if not isinstance(name, str) or not name or not is_extra(name):
            raise HandrailError(
                f"episode column {name!r}: expected a name without '/' other than {', '.join(_RESERVED)}"
            )
        plain = value.item() if isinstance(value, np.generic) else "" if value is None else value
        if type(plain) not in _TYPES:
            raise HandrailError(
                f"episode column {name!r}: expected str, bool, int or float, got {type(plain).__name__}"
            )
        found[name] = cast(Scalar, plain)
    return found


def column_types(columns: Mapping[str, Scalar]) -> ColumnTypes:
    """Return the types that the first episode's columns fix."""
    return {name: _TYPES[type(value)] for name, value in columns.items()}


def fit_columns(columns: Mapping[str, Scalar | None], types: ColumnTypes) -> dict[str, Scalar | None]:
    """Return one value for each column that the dataset has.

    Args:
        columns: Plain values.
        types: Types that the first episode fixed.
    """
    if unknown := [name for name in columns if name not in types]:
        raise HandrailError(
            f"episode column {unknown[0]!r} is new: expected those of the first episode, {', '.join(types)}"
        )
    found: dict[str, Scalar | None] = {}
    for name, kind in types.items():
        value = columns.get(name)
        if value is None or value == "":
            value = "" if kind == pa.string() else None
        elif kind == pa.float64() and type(value) is int:
            value = float(value)
        elif _TYPES[type(value)] != kind:
            raise HandrailError(f"episode column {name!r}: expected {kind} as before, got {value!r}")
        found[name] = value
    return found

"""Files of the rows of many episodes: grown by whole episodes, read one episode at a time.

A row group holds some thousand rows: LeRobot opens a file in as many steps as it has groups, and whoever
wants one episode reads those groups whose statistics of `episode_index` allow it. A file whose statistics do
not say, or say it wrongly, is read whole. Every page has a checksum, so that no rows are taken for others.
"""

import math
from collections.abc import Sequence
from contextlib import closing, suppress
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from handrail.datasets.format.tables import numbers, open_parquet, parquet_writer, to_numpy

_EPISODE = "episode_index"
_SEARCHED = [_EPISODE, "index"]  # columns whose statistics readers look rows up by
ROWS = 1000  # of a row group of several episodes
MOST_OPEN = 4  # files


class GrowingDataFile:
    """A parquet of rows that is being written, an episode after the other."""

    def __init__(self, path: Path, schema: pa.Schema):
        """Begin it.

        Raises:
            OSError: The disk does not take it.
        """
        self._sink = pa.OSFile(str(path), "wb")
        self._writer = parquet_writer(self._sink, schema, write_statistics=_SEARCHED)
        self._waiting: list[pa.Table] = []

    @property
    def size(self) -> int:
        """How large it is, about [byte]."""
        return self._sink.tell() + sum(table.nbytes for table in self._waiting)

    def add(self, episode: pa.Table) -> None:
        """Append the rows of an episode."""
        if self._waiting and sum(map(len, self._waiting)) + len(episode) > ROWS:
            self._write_group()
        self._waiting.append(episode)

    def close(self) -> None:
        """Finish the file."""
        if self._waiting:
            self._write_group()
        self._writer.close()
        self._sink.close()

    def abandon(self) -> None:
        """Let the file go, which the caller removes."""
        with suppress(OSError, pa.ArrowException):  # else it complains when it is forgotten
            self._writer.close()
        self._sink.close()

    def _write_group(self) -> None:
        table = pa.concat_tables(self._waiting)
        self._waiting = []
        self._writer.write_table(table, row_group_size=max(1, len(table)))


class DataFile:
    """A parquet of rows, open until `close`."""

    def __init__(self, path: Path):
        """Open it.

        Raises:
            OSError, pyarrow.ArrowException, ValueError: It is not there, not whole, or has no episodes.
        """
        self.path = path
        self._file = open_parquet(path)
        self._spans = _episode_spans(self._file.metadata)
        self._last: tuple[list[int], list[str] | None, pa.Table] | None = None  # what was read last

    def rows(self, episode: int, columns: Sequence[str] | None = None) -> pa.Table:
        """Return the rows of an episode, in their order.

        Args:
            episode: Its number.
            columns: Which columns; all of them without.

        Raises:
            OSError, pyarrow.ArrowException, KeyError: A row group or a column cannot be read.
        """
        wanted = None if columns is None else list(dict.fromkeys((_EPISODE, *columns)))
        near = [place for place, (least, most) in enumerate(self._spans) if least <= episode <= most]
        return self._read(near, episode, wanted)

    def all(self) -> pa.Table:
        """Return all rows.

        Raises:
            OSError, pyarrow.ArrowException: They cannot be read.
        """
        return self._file.read(use_threads=False)

    def close(self) -> None:
        """Give the file free; safe to call twice."""
        self._file.close()

    def _read(self, groups: list[int], episode: int, columns: list[str] | None) -> pa.Table:
        if self._last is None or self._last[:2] != (groups, columns):
            table = self._file.read_row_groups(groups, columns=columns, use_threads=False)
            self._last = groups, columns, table
        table = self._last[2]
        mask = to_numpy(table.column(_EPISODE).combine_chunks()) == episode
        return table if mask.all() else table.filter(numbers(mask, pa.bool_()))


def _episode_spans(metadata: pq.FileMetaData) -> list[tuple[float, float]]:
    """Return the least and the greatest episode of each row group; not by `schema`, which keeps memory."""
    spans = list[tuple[float, float]]()
    for group in map(metadata.row_group, range(metadata.num_row_groups)):
        columns = map(group.column, range(group.num_columns))
        span = next((each.statistics for each in columns if each.path_in_schema == _EPISODE), None)
        spans.append((span.min, span.max) if span and span.has_min_max else (-math.inf, math.inf))
    return spans


class DataFiles:
    """Hands out data files by their paths and keeps those that were asked for last open."""

    def __init__(self) -> None:
        """Begin without an open file."""
        self._open: dict[Path, DataFile] = {}

    def open(self, path: Path) -> DataFile:
        """Return a file, opened unless it is among the last few that were asked for."""
        found = self._open.pop(path, None) or DataFile(path)
        if len(self._open) == MOST_OPEN:
            self._open.pop(next(iter(self._open))).close()
        self._open[path] = found
        return found

    def close(self) -> None:
        """Close what is open."""
        while self._open:
            self._open.popitem()[1].close()


def data_files() -> closing[DataFiles]:
    """Provide data files that are closed in the end."""
    return closing(DataFiles())

"""The rows of an episode in a file that may hold many: opened once, its row groups found by halving.

Episodes lie in a file in their order, so the statistics of `episode_index` say in log₂(groups) steps where
one begins. A file whose statistics do not say, or say it wrongly, is read whole.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from handrail.datasets.format.arrow import numbers, to_numpy

_EPISODE = "episode_index"
MOST_OPEN = 4  # files; one of a thousand episodes takes some 25 MB of memory


class DataFile:
    """A parquet of rows, open until `close`."""

    def __init__(self, path: Path):
        """Open it.

        Raises:
            OSError, pyarrow.ArrowException, ValueError: It is not there, not whole, or has no episodes.
        """
        self.path = path
        self._file = pq.ParquetFile(path)
        self._groups = self._file.num_row_groups
        self._column = _leaves(self._file.metadata).index(_EPISODE) if self._groups else 0

    def rows(self, episode: int, length: int, columns: Sequence[str] | None = None) -> pa.Table:
        """Return the rows of an episode, in their order.

        Args:
            episode: Its number.
            length: How many rows it should have; another number is an error of the caller's to raise.
            columns: Which columns; all of them without.

        Raises:
            OSError, pyarrow.ArrowException, KeyError: A row group or a column cannot be read.
        """
        wanted = None if columns is None else list(dict.fromkeys((_EPISODE, *columns)))
        found = self._read(self._near(episode), episode, wanted)
        return found if found.num_rows == length else self._read(range(self._groups), episode, wanted)

    def all(self) -> pa.Table:
        """Return all rows.

        Raises:
            OSError, pyarrow.ArrowException: They cannot be read.
        """
        return self._file.read(use_threads=False)

    def close(self) -> None:
        """Give the file free; safe to call twice."""
        self._file.close()

    def _read(self, groups: Sequence[int], episode: int, columns: list[str] | None) -> pa.Table:
        table = self._file.read_row_groups(list(groups), columns=columns, use_threads=False)
        mask = to_numpy(table.column(_EPISODE).combine_chunks()) == episode
        return table if mask.all() else table.filter(numbers(mask, pa.bool_()))

    def _near(self, episode: int) -> range:
        """Return the row groups that may hold an episode, if the groups are in its order."""
        return range(self._first(episode, after=False), self._first(episode, after=True))

    def _first(self, episode: int, after: bool) -> int:
        """Return the first row group with rows of this episode or a later one, or of a later one only."""
        low, high = 0, self._groups
        while low < high:
            middle = (low + high) // 2
            span = self._file.metadata.row_group(middle).column(self._column).statistics
            if span is None or not span.has_min_max:
                return self._groups if after else 0
            if (span.min > episode) if after else (span.max >= episode):
                high = middle
            else:
                low = middle + 1
        return low


def _leaves(metadata: pq.FileMetaData) -> list[str]:
    """Return the paths of the columns; not by `schema`, which would keep the metadata in memory."""
    group = metadata.row_group(0)
    return [group.column(place).path_in_schema for place in range(group.num_columns)]


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


@contextmanager
def data_files() -> Iterator[DataFiles]:
    """Provide data files that are closed in the end."""
    files = DataFiles()
    try:
        yield files
    finally:
        files.close()

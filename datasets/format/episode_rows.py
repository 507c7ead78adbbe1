"""The rows of metadata of the episodes that share their files of frames and pictures: a file group.

A recorded episode is a group of its own; what is written anew has groups of many. A group's files are named
after its first episode in every stream. The file of episode rows says so in LeRobot's columns, and beside
them size and checksum of the other files, and what a group of many and those before it add up to.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from handrail.controllers.errors import HandrailError
from handrail.controllers.regular_file import regular
from handrail.datasets.format import tables
from handrail.datasets.format.info_file import Episodes, Frames, inside
from handrail.datasets.format.layout import Layout, chunk_and_file, file_index_of
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import Checksum, ColumnTypes, EpisodeRecord, Totals, is_extra
from handrail.datasets.format.schema import video_keys
from handrail.datasets.format.stats import (
    MEASURED,
    STATISTICS,
    Statistics,
    Stats,
    stats_from_lists,
    stats_to_lists,
)
from handrail.datasets.storage.strict_json import parse_json

_FILES = b"handrail"  # key in the metadata of the parquet: sizes and hashes of the group's files
_TOTALS = b"handrail.totals"
STATS = "stats/"
"""Begin of the names of columns with statistics."""


class ForeignRowError(HandrailError):
    """A row of metadata that another tool wrote."""


class EpisodeRow(msgspec.Struct, kw_only=True):
    """A row of `meta/episodes` in any dataset."""

    episode_index: Frames
    length: Frames
    chunk: Frames = msgspec.field(name="data/chunk_index")
    file: Frames = msgspec.field(name="data/file_index")
    tasks: list[str] | None = None


class _SavedRow(EpisodeRow, kw_only=True):
    """A row of an episode that Handrail saved."""

    dataset_from_index: Frames
    tasks: list[str] = msgspec.field()


class _SavedTotals(msgspec.Struct):
    episodes: Episodes
    frames: Frames
    tasks: list[str]
    stats: dict[str, dict[str, list[Any]]]


@dataclass(frozen=True)
class EpisodeRows:
    """The episode rows of one file that Handrail wrote."""

    path: Path
    rows: Sequence[dict[str, Any]]
    """Columns by name, statistics left out; a row an episode."""
    files: Mapping[str, Checksum]
    """Checksums of the group's data and video files by relative path."""
    totals: Totals | None
    """The totals of all episodes up to the last one here; None where they were not kept."""
    table: pa.Table | None
    """All columns, where they were read at once."""

    @classmethod
    def read(cls, path: Path) -> "EpisodeRows":
        """Read a file of episode rows.

        Raises:
            ForeignRowError: The file is whole, but another tool wrote it.
            OSError, pyarrow.ArrowException, ValueError, KeyError: The file is not whole, or has no row.
        """
        with tables.open_parquet(path) as file:
            marks = file.schema_arrow.metadata or {}
            if _FILES not in marks:
                raise ForeignRowError(
                    f"{str(path)!r} was written by another tool: Handrail neither repairs nor resumes a"
                    " dataset that another tool has appended to; record into another folder"
                )
            at_once = _TOTALS not in marks  # the statistics are needed, since no sum of them is there
            table = file.read(columns=None if at_once else plain_names(file), use_threads=False)
        rows = table_rows(table)
        if not rows:
            raise ValueError("no row")
        files = {inside(name): Checksum(*each) for name, each in parse_json(marks[_FILES]).items()}
        totals = None
        if _TOTALS in marks:
            said = msgspec.convert(parse_json(marks[_TOTALS]), _SavedTotals)
            totals = Totals(said.episodes, said.frames, tuple(said.tasks), stats_from_lists(said.stats))
        return cls(path, rows, files, totals, table if at_once else None)

    def __len__(self) -> int:
        return len(self.rows)

    def record(self, place: int, with_stats: bool = False) -> EpisodeRecord:
        """Return the episode of one row, with its statistics if wanted.

        Raises:
            OSError, pyarrow.ArrowException, ValueError, KeyError: The row is damaged.
        """
        said = msgspec.convert(self.rows[place], _SavedRow)
        return EpisodeRecord(
            episode=said.episode_index,
            start=said.dataset_from_index,
            length=said.length,
            tasks=tuple(said.tasks),
            stats=self._stats_of(place) if with_stats else None,
            columns={name: value for name, value in self.rows[place].items() if is_extra(name)},
            files=self.files,
            file_index=file_index_of(said.chunk, said.file),
            offset=said.dataset_from_index - int(self.rows[0]["dataset_from_index"]),
        )

    def records(self, with_stats: bool = False) -> Iterator[EpisodeRecord]:
        """Yield all episodes, in order."""
        return (self.record(place, with_stats) for place in range(len(self)))

    @cached_property
    def _stats(self) -> dict[str, dict[str, np.ndarray]]:
        """Statistics by column and name, `(E, d)`, or `(E, 3, 1, 1)` for cameras; what is not finite is 0."""
        found: dict[str, dict[str, np.ndarray]] = {}
        table = _read(self.path) if self.table is None else self.table
        for name, column in zip(table.column_names, table.columns, strict=True):
            if name.startswith(STATS):
                key, statistic = name.removeprefix(STATS).rsplit("/", 1)
                nested, kind = 0, column.type
                while pa.types.is_nested(kind):
                    nested, kind = nested + 1, kind.value_type  # type: ignore[attr-defined]
                values = tables.flat_numbers(column).reshape(len(self), -1, *[1] * (nested - 1))
                found.setdefault(key, {})[statistic] = np.where(np.isfinite(values), values, 0)
        return found

    def _stats_of(self, place: int) -> Stats:
        stats = self._stats
        return {key: {name: column[name][place] for name in STATISTICS} for key, column in stats.items()}


def row_files(layout: Layout) -> list[Path]:
    """Return the files of episode rows, in the order of their episodes."""
    return sorted(layout.episodes.glob("*/*.parquet"))


def count_rows(path: Path) -> int:
    """Return how many rows a file has; one if it cannot be read, since it was made for one at least."""
    try:
        return max(1, pq.read_metadata(regular(path)).num_rows)
    except (OSError, pa.ArrowException):
        return 1


def read_column_types(path: Path) -> ColumnTypes:
    """Return the types of the extra columns in a file of episode rows."""
    return {field.name: field.type for field in pq.read_schema(regular(path)) if is_extra(field.name)}


def plain_names(file: pq.ParquetFile) -> list[str]:
    """Return the columns of a file of episode rows without the statistics."""
    return [name for name in file.schema_arrow.names if not name.startswith(STATS)]


def table_rows(table: pa.Table) -> list[dict[str, Any]]:
    """Return a table's columns, statistics left out, as a dict a row."""
    names = [name for name in table.column_names if not name.startswith(STATS)]
    columns = [tables.plain_values(table.column(name)) for name in names]
    return [dict(zip(names, values, strict=True)) for values in zip(*columns, strict=True)]


def rows_bytes(
    manifest: Manifest, records: Sequence[EpisodeRecord], types: ColumnTypes, totals: Totals | None = None
) -> bytes:
    """Return the episode rows of a file group, as LeRobot lays them out, with Handrail's checksums.

    Args:
        manifest: The schema.
        records: The episodes, with statistics.
        types: Of the extra columns.
        totals: The totals of all episodes up to the last one; kept for a group of many.
    """
    columns = {
        "episode_index": _whole([record.episode for record in records]),
        "tasks": tables.lists(
            tables.scalars([task for record in records for task in record.tasks], pa.string()),
            [len(record.tasks) for record in records],
        ),
        "length": _whole([record.length for record in records]),
        **_place("data", records),
        "dataset_from_index": _whole([record.start for record in records]),
        "dataset_to_index": _whole([record.start + record.length for record in records]),
    }
    for key in video_keys(manifest.features):
        columns |= _place(f"videos/{key}", records)
        for name, frames in (("from", 0), ("to", 1)):
            seconds = [(record.offset + frames * record.length) / manifest.fps for record in records]
            columns[f"videos/{key}/{name}_timestamp"] = tables.numbers(seconds, pa.float64())
    for name, kind in types.items():
        columns[name] = tables.scalars([record.columns.get(name) for record in records], kind)
    stats = [record.stats or {} for record in records]
    for key in stats[0]:
        found = _statistics([each[key] for each in stats])
        columns |= {f"{STATS}{key}/{name}": found[name] for name in STATISTICS}
    columns |= _place("meta/episodes", records)
    marks: dict[bytes, str | bytes] = {_FILES: _files_json(records[0].files)}
    if totals is not None:
        said = {"episodes": totals.episodes, "frames": totals.frames, "tasks": totals.tasks}
        marks[_TOTALS] = json.dumps(said | {"stats": stats_to_lists(totals.stats or {})})
    return _bytes(pa.Table.from_arrays(list(columns.values()), names=list(columns)), marks)


def _statistics(stats: Sequence[Statistics]) -> dict[str, pa.Array]:
    """Return a column's statistics, (E, d), or (E, 3, 1, 1) of a camera, nested as the arrays are."""
    found: dict[str, pa.Array] = {}
    for names, kind in ((MEASURED, pa.float64()), (("count",), pa.int64())):
        values = np.array([each[name] for name in names for each in stats])
        nested = tables.numbers(values.reshape(-1), kind)
        for size in reversed(values.shape[1:]):
            nested = tables.lists(nested, np.full(len(nested) // size, size))
        found |= {name: nested.slice(place * len(stats), len(stats)) for place, name in enumerate(names)}
    return found


def with_checksums(path: Path, files: Mapping[str, Checksum]) -> bytes:
    """Return a file of episode rows as it is, but with other checksums of some files."""
    table, before = _read(path), EpisodeRows.read(path).files
    return _bytes(table, dict(table.schema.metadata or {}) | {_FILES: _files_json({**before, **files})})


def _read(path: Path) -> pa.Table:
    with tables.open_parquet(path) as file:
        return file.read(use_threads=False)


def _bytes(table: pa.Table, marks: Mapping[bytes, str | bytes]) -> bytes:
    texts = [field.name for field in table.schema if field.type == pa.string()] if len(table) > 1 else False
    return tables.parquet_bytes(
        table.replace_schema_metadata(marks), texts, statistics=False, arrow_schema=False
    )


def _files_json(files: Mapping[str, Checksum]) -> str:
    return json.dumps({path: [each.size, each.sha256] for path, each in files.items()})


def _place(stream: str, records: Sequence[EpisodeRecord]) -> dict[str, pa.Array]:
    places = zip(*(chunk_and_file(record.file_index) for record in records), strict=True)
    return {
        f"{stream}/{name}_index": _whole(each) for name, each in zip(("chunk", "file"), places, strict=True)
    }


def _whole(values: Sequence[int]) -> pa.Array:
    return tables.numbers(values, pa.int64())

"""The lines of metadata of a volume: the episodes whose rows and pictures share their files.

A recorded episode is a volume of its own; what is written anew has volumes of many. A volume's files are
named after its first episode, its slot, in every stream. The file of lines says so in LeRobot's columns, and
beside them size and checksum of the other files, and what a volume of many and those before it add up to.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from handrail.controllers.errors import HandrailError
from handrail.controllers.regular_file import regular
from handrail.datasets.format.arrow import (
    equal_lists,
    flat_numbers,
    lists,
    numbers,
    plain_values,
    scalars,
    strings,
)
from handrail.datasets.format.columns import ColumnTypes, is_extra
from handrail.datasets.format.info_file import SavedLine, SavedTotals
from handrail.datasets.format.layout import Layout, chunk_and_file, slot_of
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import EpisodeRecord, FileSeal, Totals
from handrail.datasets.format.path_pattern import inside
from handrail.datasets.format.schema import video_keys
from handrail.datasets.format.stats import STATISTICS, Stats, stats_from_lists, stats_to_lists
from handrail.datasets.format.tables import parquet_bytes
from handrail.datasets.storage.strict_json import parse_json

_SEALS = b"handrail"  # key in the metadata of a file of lines: sizes and hashes of the volume's files
_TOTALS = b"handrail.totals"
_STATS = "stats/"


class ForeignLineError(HandrailError):
    """A line of metadata that another tool wrote."""


@dataclass(frozen=True)
class Lines:
    """The lines of one file that Handrail wrote.

    Attributes:
        path: The file.
        names: Its columns, statistics left out.
        rows: Their values, a row an episode.
        files: Seals of the volume's data and video files by relative path.
        totals: What all episodes up to the last one here add up to; None where that was not kept.
        table: All columns, where they were read at once.
    """

    path: Path
    names: tuple[str, ...]
    rows: Sequence[tuple]
    files: Mapping[str, FileSeal]
    totals: Totals | None
    table: pa.Table | None

    @classmethod
    def read(cls, path: Path) -> "Lines":
        """Read a file of lines.

        Raises:
            ForeignLineError: The file is whole, but another tool wrote it.
            OSError, pyarrow.ArrowException, ValueError, KeyError: The file is not whole, or has no line.
        """
        with pq.ParquetFile(regular(path)) as file:
            marks = file.schema_arrow.metadata or {}
            if _SEALS not in marks:
                raise ForeignLineError(
                    f"{str(path)!r} was written by another tool: Handrail neither repairs nor resumes a"
                    " dataset that another tool has appended to; record into another folder"
                )
            names = tuple(name for name in file.schema_arrow.names if not name.startswith(_STATS))
            at_once = _TOTALS not in marks  # the statistics are needed, since no sum of them is there
            table = file.read(columns=None if at_once else list(names), use_threads=False)
        rows = tuple(zip(*(plain_values(table.column(name)) for name in names), strict=True))
        if not rows:
            raise ValueError("no line")
        seals = {inside(name): FileSeal(*seal) for name, seal in parse_json(marks[_SEALS]).items()}
        totals = None
        if _TOTALS in marks:
            said = msgspec.convert(parse_json(marks[_TOTALS]), SavedTotals)
            totals = Totals(said.episodes, said.frames, tuple(said.tasks), stats_from_lists(said.stats))
        return cls(path, names, rows, seals, totals, table if at_once else None)

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def length(self) -> int:
        """Number of frames of all its episodes."""
        return sum(self.record(place).length for place in range(len(self)))

    def record(self, place: int, with_stats: bool = False) -> EpisodeRecord:
        """Return one episode.

        Args:
            place: Which of the lines.
            with_stats: Whether its statistics are wanted.

        Raises:
            OSError, pyarrow.ArrowException, ValueError, KeyError: The line is damaged.
        """
        row = dict(zip(self.names, self.rows[place], strict=True))
        line = msgspec.convert(row, SavedLine)
        return EpisodeRecord(
            episode=line.episode_index,
            start=line.dataset_from_index,
            length=line.length,
            tasks=tuple(line.tasks),
            stats=self._stats_of(place) if with_stats else None,
            columns={name: value for name, value in row.items() if is_extra(name)},
            files=self.files,
            slot=slot_of(line.chunk, line.file),
            offset=line.dataset_from_index - int(self.rows[0][self.names.index("dataset_from_index")]),
            alone=len(self) == 1,
        )

    def records(self, with_stats: bool = False) -> Iterator[EpisodeRecord]:
        """Yield all episodes, in order."""
        return (self.record(place, with_stats) for place in range(len(self)))

    @cached_property
    def _stats(self) -> dict[str, dict[str, np.ndarray]]:
        """Statistics by column and name, `(E, d)`, or `(E, 3, 1, 1)` for cameras; what is not finite is 0."""
        found: dict[str, dict[str, np.ndarray]] = {}
        table = self.table
        if table is None:
            with pq.ParquetFile(regular(self.path)) as file:
                table = file.read(use_threads=False)
        for name, column in zip(table.column_names, table.columns, strict=True):
            if name.startswith(_STATS):
                key, statistic = name.removeprefix(_STATS).rsplit("/", 1)
                values = flat_numbers(column).reshape(len(self), *_shape(column.type))
                found.setdefault(key, {})[statistic] = np.where(np.isfinite(values), values, 0)
        return found

    def _stats_of(self, place: int) -> Stats:
        stats = self._stats
        return {key: {name: column[name][place] for name in STATISTICS} for key, column in stats.items()}


def rows_of_lines(layout: Layout) -> list[Path]:
    """Return the files of lines, in the order of their episodes."""
    return sorted(layout.root.glob("meta/episodes/*/*.parquet"))


def each_line(layout: Layout, with_stats: bool = False) -> Iterator[EpisodeRecord]:
    """Yield the episodes of a dataset that Handrail wrote, a volume in memory at a time; see `Lines.read`."""
    for path in rows_of_lines(layout):
        yield from Lines.read(path).records(with_stats)


def count_lines(path: Path) -> int:
    """Return how many lines a file has; one if it cannot be read, since it was made for one at least."""
    try:
        return max(1, pq.read_metadata(regular(path)).num_rows)
    except (OSError, pa.ArrowException):
        return 1


def lines_bytes(
    manifest: Manifest,
    records: Sequence[EpisodeRecord],
    types: ColumnTypes,
    totals: Totals | None = None,
) -> bytes:
    """Return the file of lines of a volume, as LeRobot lays it out, with Handrail's seals.

    Args:
        manifest: The schema.
        records: The episodes, with statistics; all of one slot.
        types: Of the extra columns.
        totals: What all episodes up to the last one add up to; kept for a volume of many.
    """
    extras = {
        name: scalars([record.columns.get(name) for record in records], kind) for name, kind in types.items()
    }
    columns = _line_columns(manifest, records) | extras | _stats_columns([r.stats or {} for r in records])
    columns |= _place("meta/episodes", records)
    table = pa.Table.from_arrays(list(columns.values()), names=list(columns))
    marks = {_SEALS: _seals_json(records[0].files)}
    marks |= {_TOTALS: _totals_json(totals)} if totals is not None else {}
    return _bytes(table, marks)


def resealed_bytes(path: Path, files: Mapping[str, FileSeal]) -> bytes:
    """Return a file of lines as it is, but with other seals."""
    with pq.ParquetFile(regular(path)) as file:
        table = file.read(use_threads=False)
    return _bytes(table, dict(table.schema.metadata or {}) | {_SEALS: _seals_json(files)})


def read_column_types(path: Path) -> ColumnTypes:
    """Return the types of the extra columns in a file of lines."""
    return {field.name: field.type for field in pq.read_schema(regular(path)) if is_extra(field.name)}


def _bytes(table: pa.Table, marks: Mapping[bytes, str | bytes]) -> bytes:
    texts = [field.name for field in table.schema if field.type == pa.string()] if len(table) > 1 else False
    return parquet_bytes(table.replace_schema_metadata(marks), texts, statistics=False, arrow_schema=False)


def _seals_json(files: Mapping[str, FileSeal]) -> str:
    return json.dumps({path: [seal.size, seal.sha256] for path, seal in files.items()})


def _totals_json(totals: Totals) -> str:
    content = {"episodes": totals.episodes, "frames": totals.frames, "tasks": totals.tasks}
    return json.dumps(content | {"stats": stats_to_lists(totals.stats or {})})


def _line_columns(manifest: Manifest, records: Sequence[EpisodeRecord]) -> dict[str, pa.Array]:
    tasks = [task for record in records for task in record.tasks]
    columns = {
        "episode_index": _whole([record.episode for record in records]),
        "tasks": lists(strings(tasks), [len(record.tasks) for record in records]),
        "length": _whole([record.length for record in records]),
        **_place("data", records),
        "dataset_from_index": _whole([record.start for record in records]),
        "dataset_to_index": _whole([record.start + record.length for record in records]),
    }
    for key in video_keys(manifest.features):
        columns |= _place(f"videos/{key}", records)
        for name, frames in (("from", 0), ("to", 1)):
            seconds = [(record.offset + frames * record.length) / manifest.fps for record in records]
            columns[f"videos/{key}/{name}_timestamp"] = numbers(np.array(seconds), pa.float64())
    return columns


def _place(stream: str, records: Sequence[EpisodeRecord]) -> dict[str, pa.Array]:
    places = np.array([chunk_and_file(record.slot) for record in records])
    return {f"{stream}/chunk_index": _whole(places[:, 0]), f"{stream}/file_index": _whole(places[:, 1])}


def _whole(values: Sequence[int] | np.ndarray) -> pa.Array:
    return numbers(np.asarray(values), pa.int64())


def _stats_columns(stats: Sequence[Stats]) -> dict[str, pa.Array]:
    return {
        f"{_STATS}{key}/{name}": _stats_array(np.stack([each[key][name] for each in stats]), name)
        for key in stats[0]
        for name in STATISTICS
    }


def _stats_array(values: np.ndarray, name: str) -> pa.Array:
    """Return a column of lists, nested as the arrays are.

    Args:
        values: `(E, d)`, or `(E, 3, 1, 1)` of a camera.
        name: Of the statistic.
    """
    found = numbers(values.reshape(-1), pa.int64() if name == "count" else pa.float64())
    for size in reversed(values.shape[1:]):
        found = equal_lists(found, size)
    return found


def _shape(kind: pa.DataType) -> tuple[int, ...]:
    """Return the shape of a statistic by its nesting: lists, or LeRobot's `(c, 1, 1)` of a camera."""
    depth = 0
    while pa.types.is_nested(kind):
        kind, depth = kind.value_type, depth + 1  # type: ignore[attr-defined]
    return (-1, *([1] * (depth - 1)))

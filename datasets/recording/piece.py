"""An episode, or a stretch of one, on its way into a dataset: rows, pictures, and what is said of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from dataclasses import replace as changed
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.arrow import flat_numbers, numbers, to_numpy
from handrail.datasets.format.columns import Scalar
from handrail.datasets.format.data_file import DataFiles
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import EpisodeRecord, Totals
from handrail.datasets.format.schema import video_keys
from handrail.datasets.format.stats import Stats, column_stats

TRIMMED = "trimmed_start"  # episode column: how many frames were cut off at the beginning
_SUCCESS, _DONE = "next.success", "next.done"


@dataclass(frozen=True)
class Piece:
    """A stretch of an episode and what is to be said of it.

    Attributes:
        data: The parquet that has its rows.
        videos: The mp4 that has its pictures, by camera.
        record: The episode's line of metadata, with statistics.
        first: The first frame that is taken.
        length: Number of frames.
        columns: Extra columns of the new line.
        sentences: The new sentence of a task, by the old one; of the others it stays.
        success: What is to be in `next.success`: whether it succeeded; None leaves it.
    """

    data: Path
    videos: Mapping[str, Path]
    record: EpisodeRecord
    first: int
    length: int
    columns: Mapping[str, Scalar | None]
    sentences: Mapping[str, str] = field(default_factory=dict)
    success: bool | None = None

    @classmethod
    def of(cls, folder: Layout, manifest: Manifest, record: EpisodeRecord) -> "Piece":
        """Return a whole episode, whose files are at the places of a dataset."""
        videos = {key: folder.video(key, record.slot) for key in video_keys(manifest.features)}
        return cls(folder.data(record.slot), videos, record, 0, record.length, record.columns)

    @property
    def is_cut(self) -> bool:
        """Whether some of the episode's frames are left out."""
        return self.length != self.record.length

    @property
    def first_picture(self) -> int:
        """Which picture of its videos is the first."""
        return self.record.offset + self.first

    def stretch(self, first: int, length: int) -> "Piece":
        """Return a part of it."""
        return changed(self, first=self.first + first, length=length)

    def saying(self, **columns: Scalar | None) -> "Piece":
        """Return it with other columns of metadata."""
        return changed(self, columns={**self.columns, **columns})

    def ending(self, success: bool) -> "Piece":
        """Return it with frames that say whether it succeeded."""
        return changed(self, success=success)

    def renamed(self, sentences: Mapping[str, str]) -> "Piece":
        """Return it with other task sentences, by the old ones."""
        return changed(self, sentences=dict(sentences))

    def rows(
        self, schema: pa.Schema, fps: int, totals: Totals, files: DataFiles
    ) -> tuple[pa.Table, tuple[str, ...], Stats]:
        """Return the rows in their new place.

        Args:
            schema: Of the data files of both datasets.
            fps: Frames a second [Hz].
            totals: What the episodes before it add up to.
            files: Opens the file of the rows.

        Returns:
            The rows, their task sentences in order, and the statistics of the columns that have changed.
        """
        whole = files.open(self.data).rows(self.record.episode, self.record.length)
        if whole.num_rows != self.record.length:
            raise ValueError(f"{self.data}: {whole.num_rows} rows instead of {self.record.length}")
        whole = whole.select(schema.names).cast(schema)
        table = whole.slice(self.first, self.length)
        tasks, places = self._tasks(whole, table, totals)
        values = self._counters(fps, totals) | {"task_index": places} | self._ending(table)
        for name, column in values.items():
            place = table.schema.get_field_index(name)
            kind = table.schema.field(place)
            table = table.set_column(place, kind, numbers(column, kind.type))
        anew = table.column_names if self.is_cut else values
        stats = {name: column_stats(rows) for name in anew if (rows := _numbers(table, name)) is not None}
        return table, tasks, stats

    def _counters(self, fps: int, totals: Totals) -> dict[str, np.ndarray]:
        frames = np.arange(self.length)
        new = {
            "episode_index": np.full(self.length, totals.episodes),
            "index": frames + totals.frames,
        }
        return new | ({"frame_index": frames, "timestamp": frames / fps} if self.is_cut else {})

    def _tasks(self, whole: pa.Table, table: pa.Table, totals: Totals) -> tuple[tuple[str, ...], np.ndarray]:
        """Return the task sentences of rows, and which of the dataset's each row has, (N,)."""
        numbers_of = dict.fromkeys(whole.column("task_index").to_pylist())
        known = self.record.tasks
        if len(known) != len(numbers_of):
            where = f"{str(self.data)!r}, episode {self.record.episode}"
            raise HandrailError(f"{where}: expected rows of {len(known)} tasks, got {len(numbers_of)}")
        sentences = dict(zip(numbers_of, (self.sentences.get(each, each) for each in known), strict=True))
        said = [sentences[number] for number in table.column("task_index").to_pylist()]
        tasks = tuple(dict.fromkeys(said))
        places = {sentence: place for place, sentence in enumerate(totals.with_tasks(tasks))}
        return tasks, np.array([places[sentence] for sentence in said])

    def _ending(self, table: pa.Table) -> dict[str, np.ndarray]:
        """Return how the episode ends, where that is not as it was: `next.done`, `next.success`."""
        found: dict[str, np.ndarray] = {}
        if self.is_cut and _DONE in table.column_names:
            found[_DONE] = np.arange(self.length) == self.length - 1
        if self.success is not None and _SUCCESS in table.column_names:
            before = to_numpy(table.column(_SUCCESS).combine_chunks()).astype(bool) & self.success
            last = np.arange(self.length) == self.length - 1
            found[_SUCCESS] = before | last if self.success and not before.any() else before
        return found


def _numbers(table: pa.Table, name: str) -> np.ndarray | None:
    """Return a column of numbers, (N,) or (N, d); None for texts."""
    column: Any = table.column(name)
    if pa.types.is_string(column.type):
        return None
    flat = flat_numbers(column)
    return flat if len(flat) == table.num_rows else flat.reshape(table.num_rows, -1)

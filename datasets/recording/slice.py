"""A stretch of an episode on its way into a dataset: rows, pictures, and what is said of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pyarrow as pa

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.data_file import DataFiles
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import EpisodeRecord, Scalar, Totals
from handrail.datasets.format.schema import video_keys
from handrail.datasets.format.stats import Stats, column_stats
from handrail.datasets.format.tables import column_array, column_values, numbers
from handrail.datasets.recording.frames import MASK, of_demonstration

TRIMMED = "trimmed_start"  # episode column: how many frames were cut off at the beginning
_SUCCESS, _DONE = "next.success", "next.done"


@dataclass(frozen=True)
class EpisodeSlice:
    """A stretch of an episode and what is to be said of it."""

    data: Path
    """The parquet with its rows."""
    videos: Mapping[str, Path]
    """The mp4 with its pictures, by camera."""
    record: EpisodeRecord
    """The whole episode, with statistics."""
    first: int
    """The first frame that is taken."""
    length: int
    """Number of frames."""
    columns: Mapping[str, Scalar | None]
    """Extra columns of the new row of metadata."""
    sentences: Mapping[str, str] = field(default_factory=dict)
    """New task sentences, by the old ones; the others stay."""
    success: bool | None = None
    """New outcome for `next.success`; None leaves it."""

    @classmethod
    def of(cls, folder: Layout, manifest: Manifest, record: EpisodeRecord) -> "EpisodeSlice":
        """Return a whole episode, whose files are at the places of a dataset."""
        videos = {key: folder.video(key, record.file_index) for key in video_keys(manifest.features)}
        return cls(folder.data(record.file_index), videos, record, 0, record.length, record.columns)

    @property
    def is_cut(self) -> bool:
        """Whether some of the episode's frames are left out."""
        return self.length != self.record.length

    @property
    def first_picture(self) -> int:
        """The place of its first picture in its videos."""
        return self.record.offset + self.first

    def saying(self, **columns: Scalar | None) -> "EpisodeSlice":
        """Return it with other columns of metadata."""
        return replace(self, columns={**self.columns, **columns})

    def rows(
        self, schema: pa.Schema, fps: int, totals: Totals, files: DataFiles
    ) -> tuple[pa.Table, tuple[str, ...], Stats]:
        """Return the rows in their new place, their task sentences, and statistics of what has changed.

        Args:
            schema: Of the data files of both datasets.
            fps: Frames a second [Hz].
            totals: The totals of the episodes before it.
            files: Opens the file of the rows.
        """
        whole = files.open(self.data).rows(self.record.episode)
        if whole.num_rows != self.record.length:
            raise ValueError(f"{self.data}: {whole.num_rows} rows instead of {self.record.length}")
        lacking = [field for field in schema if field.name not in whole.schema.names]
        whole = _demonstrated(whole, lacking).select(schema.names).cast(schema)
        table = whole.slice(self.first, self.length)
        tasks, values = self._tasks(whole, totals)
        frames = np.arange(self.length)
        values |= {"episode_index": np.full(self.length, totals.episodes), "index": frames + totals.frames}
        if self.is_cut:
            values |= {"frame_index": frames, "timestamp": frames / fps, _DONE: frames == self.length - 1}
        if self.success is not None and _SUCCESS in schema.names:
            before = column_values(table, _SUCCESS) & self.success
            values[_SUCCESS] = before | (
                frames == self.length - 1 if self.success and not before.any() else False
            )
        for name in values.keys() & set(schema.names):
            place = schema.get_field_index(name)
            table = table.set_column(
                place, schema.field(place), numbers(values[name], schema.field(place).type)
            )
        anew = [field for field in schema if self.is_cut or field.name in values or field in lacking]
        texts = pa.string()
        stats = {
            each.name: column_stats(column_values(table, each.name)) for each in anew if each.type != texts
        }
        return table, tasks, stats

    def _tasks(self, whole: pa.Table, totals: Totals) -> tuple[tuple[str, ...], dict[str, np.ndarray]]:
        """Return the task sentences of the stretch, and `task_index` of its rows in the new dataset, (N,)."""
        given = whole.column("task_index").to_pylist()
        known, places = self.record.tasks, dict.fromkeys(given)
        if len(known) != len(places):
            where = f"{str(self.data)!r}, episode {self.record.episode}"
            raise HandrailError(f"{where}: expected rows of {len(known)} tasks, got {len(places)}")
        sentences = dict(zip(places, (self.sentences.get(each, each) for each in known), strict=True))
        said = [sentences[place] for place in given[self.first : self.first + self.length]]
        tasks = tuple(dict.fromkeys(said))
        everything = totals.with_tasks(tasks)
        return tasks, {"task_index": np.array([everything.index(sentence) for sentence in said])}


def _demonstrated(table: pa.Table, lacking: Sequence[pa.Field]) -> pa.Table:
    """Return the rows of an episode without a policy with the shared columns that they lack."""
    if lacking:
        values = of_demonstration(column_values(table, MASK))
        for field in lacking:
            table = table.append_column(field, column_array(values[field.name], field.type))
    return table

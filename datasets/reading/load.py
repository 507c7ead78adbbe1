"""The episodes of a dataset: by their rows of metadata, or with their rows."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.data_file import DataFiles, data_files
from handrail.datasets.reading.columns import ColumnNames
from handrail.datasets.reading.demonstration import Demonstration, Episode
from handrail.datasets.reading.reader import DatasetInfo, read_episodes, read_info, read_rows_of, with_success
from handrail.datasets.reading.simulated import kept_in_state, out_of_state


@dataclass(frozen=True)
class Recorded(Episode):
    """An episode whose rows are on the disk; a thousand of them take the memory of their metadata."""

    number: int
    info: DatasetInfo
    meta: Mapping[str, Any]
    columns: ColumnNames
    wanted: tuple[str, ...]
    """The columns that are read."""

    def opened(self, files: DataFiles) -> Demonstration:
        """Return it with its rows; see `Episode.opened`."""
        frames = read_rows_of(self.info, self.meta, self.wanted, files)
        frames = out_of_state(kept_in_state(self.info.robot_type, self.info.features), frames) | frames
        return Demonstration(self.number, self.info, frames, self.meta, self.columns)


def recorded_episodes(root: str | Path, columns: ColumnNames | None = None) -> list[Recorded]:
    """Return all episodes of a LeRobot v3.0 dataset, whoever recorded it; their rows stay on the disk.

    Args:
        root: The dataset's folder.
        columns: Which column plays which part.
    """
    columns, info = columns or ColumnNames(), read_info(root)
    wanted, rows = _wanted(info, columns), with_success(info, read_episodes(root))
    return [Recorded(row["episode_index"], info, row, columns, wanted) for row in rows]


def some_recorded(root: str | Path, columns: ColumnNames | None = None) -> list[Recorded]:
    """Return what `recorded_episodes` returns, one episode or more."""
    if episodes := recorded_episodes(root, columns):
        return episodes
    raise HandrailError(f"dataset {str(root)!r}: expected an episode or more, found none")


def each_opened(episodes: Iterable[Episode]) -> Iterator[Demonstration]:
    """Yield episodes with their rows, one in memory at a time."""
    with data_files() as files:
        for episode in episodes:
            yield episode.opened(files)


def read_demonstrations(root: str | Path, columns: ColumnNames | None = None) -> list[Demonstration]:
    """Return the episodes that `recorded_episodes` returns with their rows, all in memory."""
    return list(each_opened(recorded_episodes(root, columns)))


def _wanted(info: DatasetInfo, columns: ColumnNames) -> tuple[str, ...]:
    """Return the columns that play a part, and all numbers that a policy reads."""
    parts = {name for part in columns.__dataclass_fields__ for name in columns.choices(part)}
    return tuple(
        name
        for name, feature in info.features.items()
        if feature.dtype not in ("video", "image") and (name in parts or name.startswith("observation"))
    )

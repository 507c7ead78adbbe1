"""A dataset that is open for several episodes: its lines of metadata are read once, its files stay open."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.data_file import DataFiles, data_files
from handrail.datasets.reading.reader import DatasetInfo, read_episodes, read_info, read_rows_of


@dataclass(frozen=True)
class OpenDataset:
    """A dataset."""

    info: DatasetInfo  # What it is
    rows: Sequence[dict[str, Any]]  # Lines of metadata of all episodes, in order
    files: DataFiles  # Its data files that were read last

    def row(self, episode: int) -> dict[str, Any]:
        """Return the line of metadata of an episode."""
        if not 0 <= episode < len(self.rows):
            raise HandrailError(
                f"--episode {episode}: expected one of 0 to {len(self.rows) - 1} in {self.info.root}"
            )
        return self.rows[episode]

    def frames(self, episode: int, columns: Sequence[str] | None = None) -> dict[str, np.ndarray]:
        """Return the rows of an episode, see `reader.read_frames`."""
        return read_rows_of(self.info, self.row(episode), columns, self.files)


@contextmanager
def open_dataset(root: str | Path) -> Iterator[OpenDataset]:
    """Provide a dataset whose files are closed in the end."""
    with data_files() as files:
        yield OpenDataset(read_info(root), read_episodes(root), files)

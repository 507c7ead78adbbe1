"""Reading a dataset's episodes as demonstrations."""

from collections.abc import Iterator
from pathlib import Path

from handrail.datasets.format.data_file import data_files
from handrail.datasets.quality.columns import ColumnNames
from handrail.datasets.quality.demonstration import Demonstration
from handrail.datasets.reading.reader import DatasetInfo, read_episodes, read_info, read_rows_of, with_success


def read_demonstrations(root: str | Path, columns: ColumnNames | None = None) -> list[Demonstration]:
    """Return all episodes of a LeRobot v3.0 dataset, whoever recorded it, in order.

    Args:
        root: The dataset's folder.
        columns: Which column plays which part.

    Raises:
        HandrailError: There is no dataset, or a file of it cannot be read.
    """
    return list(each_demonstration(root, columns))


def each_demonstration(root: str | Path, columns: ColumnNames | None = None) -> Iterator[Demonstration]:
    """Yield the episodes that `read_demonstrations` returns, one in memory at a time."""
    columns, info = columns or ColumnNames(), read_info(root)
    wanted, rows = _wanted(info, columns), with_success(info, read_episodes(root))
    with data_files() as files:
        for row in rows:
            frames = read_rows_of(info, row, wanted, files)
            yield Demonstration(row["episode_index"], info, frames, row, columns)


def _wanted(info: DatasetInfo, columns: ColumnNames) -> list[str]:
    """Return the columns that play a part, and all numbers that a policy reads."""
    parts = {name for part in columns.__dataclass_fields__ for name in columns.choices(part)}
    return [
        name
        for name, feature in info.features.items()
        if feature.dtype not in ("video", "image") and (name in parts or name.startswith("observation"))
    ]

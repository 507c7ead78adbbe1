"""Reading any LeRobot v3.0 dataset without LeRobot: what it is, its episodes, the rows of one episode.

Pictures are not read here; `LeRobotDataset` does that.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from handrail.controllers.errors import HandrailError, unknown_name
from handrail.datasets.arrow import numbers, to_numpy
from handrail.datasets.layout import Layout
from handrail.datasets.schema import Feature

_UNREADABLE = (OSError, pa.ArrowException, ValueError, KeyError, TypeError, AttributeError)


@dataclass(frozen=True)
class DatasetInfo:
    """What `meta/info.json` says.

    Attributes:
        root: The dataset's folder.
        fps: Frames a second [Hz].
        robot_type: The robot, or "".
        features: All columns, LeRobot's own included.
        episodes: Number of episodes.
        frames: Number of frames.
        data_path: Pattern of the data files.
        from_handrail: Whether Handrail recorded it.
    """

    root: Path
    fps: int
    robot_type: str
    features: dict[str, Feature]
    episodes: int
    frames: int
    data_path: str
    from_handrail: bool


def read_info(root: str | Path) -> DatasetInfo:
    """Read what a dataset is.

    Raises:
        HandrailError: There is no dataset, its `info.json` is torn, or it is of another version.
    """
    layout = Layout(Path(root).expanduser().absolute())
    content = _info_content(layout)
    version = content.get("codebase_version")
    if not str(version).startswith("v3."):
        raise HandrailError(
            f"dataset {str(layout.root)!r}: expected version v3.0, got {version};"
            " lerobot.scripts.convert_dataset_v21_to_v30 converts older ones"
        )
    try:
        return DatasetInfo(
            root=layout.root,
            fps=content["fps"],
            robot_type=content.get("robot_type") or "",
            features={key: _feature(value) for key, value in content["features"].items()},
            episodes=content["total_episodes"],
            frames=content["total_frames"],
            data_path=content["data_path"],
            from_handrail=layout.manifest.is_file(),
        )
    except _UNREADABLE as error:
        raise _torn(layout.info, error) from error


def read_episodes(root: str | Path) -> list[dict[str, Any]]:
    """Read the lines of metadata of all episodes, in order.

    Args:
        root: The dataset's folder.

    Returns:
        For each episode a dict: `episode_index`, `length` (frames), `tasks` (list of str),
        `dataset_from_index`, `data/chunk_index`, …, and extra columns such as `success`; no statistics.

    Raises:
        HandrailError: There is no dataset, or a file of it cannot be read.
    """
    info = read_info(root)
    rows: list[dict[str, Any]] = []
    for path in sorted(info.root.glob("meta/episodes/*/*.parquet")):
        rows += _read_rows(path)
    if len(rows) < info.episodes:
        raise HandrailError(
            f"dataset {str(info.root)!r}: expected {info.episodes} lines in meta/episodes, got {len(rows)};"
            + _advice(info.from_handrail)
        )
    return sorted(rows, key=lambda row: row["episode_index"])


def read_frames(
    root: str | Path, episode: int, columns: Sequence[str] | None = None
) -> dict[str, np.ndarray]:
    """Read the rows of one episode, also where a file holds several.

    Args:
        root: The dataset's folder.
        episode: Its number.
        columns: Which columns; None for all but pictures.

    Returns:
        For each column `(N,)` values where the feature's shape is `(1,)`, else `(N, *shape)`; strings as
        an array of str.

    Raises:
        HandrailError: There is no such dataset, episode or column, or the file cannot be read.
    """
    info = read_info(root)
    rows = {row["episode_index"]: row for row in read_episodes(root)}
    if episode not in rows:
        raise HandrailError(f"episode {episode}: expected one of 0 to {len(rows) - 1} in {str(info.root)!r}")
    return read_rows_of(info, rows[episode], columns)


def read_rows_of(
    info: DatasetInfo, episode: dict[str, Any], columns: Sequence[str] | None = None
) -> dict[str, np.ndarray]:
    """Read the rows of one episode whose line of metadata is at hand; see `read_frames`."""
    names = _chosen(info, columns)
    place = {"chunk_index": episode["data/chunk_index"], "file_index": episode["data/file_index"]}
    path = info.root / info.data_path.format(**place)
    number = episode["episode_index"]
    try:
        table = _episode_table(path, number, names)
        frames = {name: _to_numpy(table.column(name), info.features[name]) for name in names}
    except _UNREADABLE as error:
        raise _torn(path, error, _advice(info.from_handrail)) from error
    if table.num_rows != episode["length"]:
        raise HandrailError(
            f"{str(path)!r}: expected {episode['length']} rows of episode {number}, found {table.num_rows};"
            + _advice(info.from_handrail)
        )
    return frames


def _chosen(info: DatasetInfo, columns: Sequence[str] | None) -> tuple[str, ...]:
    readable = [key for key, feature in info.features.items() if feature.dtype not in ("video", "image")]
    if columns is None:
        return tuple(readable)
    for column in columns:
        if column not in readable:
            raise unknown_name("column", column, readable)
    return tuple(columns)


def _episode_table(path: Path, episode: int, names: Sequence[str]) -> pa.Table:
    """Read the rows of one episode; row groups that cannot hold any are skipped."""
    with pq.ParquetFile(path) as file:
        groups = [group for group in range(file.num_row_groups) if _may_hold(file.metadata, group, episode)]
        wanted = list(dict.fromkeys(("episode_index", *names)))
        table = file.read_row_groups(groups, columns=wanted)
    mask = to_numpy(table.column("episode_index").combine_chunks()) == episode
    return table.filter(numbers(mask, pa.bool_()))


def _may_hold(metadata: pq.FileMetaData, group: int, episode: int) -> bool:
    columns = [metadata.row_group(group).column(i) for i in range(metadata.num_columns)]
    (column,) = [column for column in columns if column.path_in_schema == "episode_index"]
    span = column.statistics
    return span is None or not span.has_min_max or span.min <= episode <= span.max


def _to_numpy(column: pa.ChunkedArray, feature: Feature) -> np.ndarray:
    if feature.dtype == "string":
        return np.array([value or "" for value in column.to_pylist()], dtype=str)
    values = column.combine_chunks()
    while isinstance(values, pa.ExtensionArray) or pa.types.is_nested(values.type):
        values = values.storage if isinstance(values, pa.ExtensionArray) else values.flatten()
    flat = to_numpy(values).astype(feature.dtype)
    return flat if feature.is_scalar else flat.reshape(-1, *feature.shape)


def _read_rows(path: Path) -> list[dict[str, Any]]:
    try:
        with pq.ParquetFile(path) as file:
            names = [name for name in file.schema_arrow.names if not name.startswith("stats/")]
            return file.read(columns=names, use_threads=False).to_pylist()
    except _UNREADABLE as error:
        raise _torn(path, error) from error


def _info_content(layout: Layout) -> dict[str, Any]:
    root = str(layout.root)
    if not layout.root.is_dir():
        raise HandrailError(f"dataset {root!r}: expected a folder, found none; check the path")
    if not layout.info.is_file() and not layout.manifest.is_file():
        raise HandrailError(f"{root!r} is not a LeRobot dataset (no meta/info.json); check the path")
    try:
        content = json.loads(layout.info.read_bytes())
        if not isinstance(content, dict):
            raise ValueError("no JSON object")
    except _UNREADABLE as error:
        raise _torn(layout.info, error, _advice(layout.manifest.is_file())) from error
    return content


def _feature(value: dict[str, Any]) -> Feature:
    names = value.get("names")
    if isinstance(names, dict):  # older datasets: {"motors": [...]}
        names = next((entry for entry in names.values() if isinstance(entry, list)), None)
    return Feature(value["dtype"], tuple(value["shape"]), tuple(names) if names else None)


def _torn(path: Path, error: Exception, advice: str = " the dataset is damaged") -> HandrailError:
    reason = "no such file" if isinstance(error, FileNotFoundError) else str(error).partition("\n")[0]
    return HandrailError(f"{str(path)!r} cannot be read ({reason});{advice}")


def _advice(from_handrail: bool) -> str:
    if from_handrail:
        return " repair it with handrail.datasets.repair"
    return " the dataset is damaged, and Handrail repairs only its own"

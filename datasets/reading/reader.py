"""Reading any LeRobot v3.0 dataset without LeRobot: what it is, its episodes, the rows of one episode.

Pictures are not read here; `LeRobotDataset` does that.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.regular_file import regular
from handrail.datasets.format.arrow import flat_numbers, plain_values
from handrail.datasets.format.data_file import DataFiles, data_files
from handrail.datasets.format.info_file import EpisodeLine, InfoFile, columns_of
from handrail.datasets.format.layout import VIDEO_PATH, Layout
from handrail.datasets.format.manifest import read_manifest
from handrail.datasets.format.path_pattern import fill
from handrail.datasets.format.schema import NUMBERS, Feature
from handrail.datasets.reading.simulated import STATE, SUCCESS, kept_in_state, out_of_state
from handrail.datasets.storage.strict_json import read_json

_DAMAGED = " the dataset is damaged"
_READABLE = (*NUMBERS, "float16", "string")
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
        data_path: Pattern of the data files; see `path_pattern.fill`.
        video_path: Pattern of the video files.
        from_handrail: Whether Handrail recorded it.
    """

    root: Path
    fps: int
    robot_type: str
    features: dict[str, Feature]
    episodes: int
    frames: int
    data_path: str
    video_path: str
    from_handrail: bool


def read_info(root: str | Path) -> DatasetInfo:
    """Read what a dataset is."""
    layout = Layout(Path(root).expanduser().absolute())
    content = _info_content(layout)
    version = str(content.get("codebase_version"))
    if not version.startswith("v3."):
        raise HandrailError(
            f"dataset {str(layout.root)!r}: expected version v3.0, got {version[:60]};"
            " lerobot.scripts.convert_dataset_v21_to_v30 converts older ones"
        )
    if layout.manifest.exists():
        read_manifest(layout)  # of a format that this version understands
    try:
        said = msgspec.convert(content, InfoFile)
        return DatasetInfo(
            root=layout.root,
            fps=said.fps,  # type: ignore[arg-type] - of some other tool's datasets it is no whole number
            robot_type=said.robot_type or "",
            features=columns_of(said.features),
            episodes=said.total_episodes,
            frames=said.total_frames,
            data_path=said.data_path,
            video_path=said.video_path or VIDEO_PATH,
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
    """
    info = read_info(root)
    rows: list[dict[str, Any]] = []
    for path in sorted(info.root.glob("meta/episodes/*/*.parquet")):
        rows += _read_rows(path)
    rows.sort(key=lambda row: row["episode_index"])
    numbers = [row["episode_index"] for row in rows]
    if numbers != list(range(max(len(rows), info.episodes))):
        raise HandrailError(
            f"dataset {str(info.root)!r}: expected {info.episodes} episodes in meta/episodes,"
            f" got {len(rows)} lines{_first_odd(numbers)}: it was copied in part, or is damaged;"
            + _advice(info)
        )
    return rows


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
    """
    info = read_info(root)
    rows = {row["episode_index"]: row for row in read_episodes(root)}
    if episode not in rows:
        raise HandrailError(f"episode {episode}: expected one of 0 to {len(rows) - 1} in {str(info.root)!r}")
    return read_rows_of(info, rows[episode], columns)


def read_rows_of(
    info: DatasetInfo,
    episode: Mapping[str, Any],
    columns: Sequence[str] | None = None,
    files: DataFiles | None = None,
) -> dict[str, np.ndarray]:
    """Read the rows of one episode whose line of metadata is at hand; see `read_frames`.

    Many episodes may share a file: whoever reads several gives `data_files()`, so that it is opened once.
    """
    if files is None:
        with data_files() as files:
            return read_rows_of(info, episode, columns, files)
    names = _chosen(info, columns)
    path = info.root / fill(info.data_path, episode["data/chunk_index"], episode["data/file_index"])
    number = episode["episode_index"]
    try:
        table = files.open(path).rows(number, episode["length"], names)
        frames = {name: _to_numpy(table.column(name), info.features[name]) for name in names}
    except FileNotFoundError as error:
        raise HandrailError(
            f"dataset {str(info.root)!r}: {path.relative_to(info.root)} of episode {number} is missing:"
            f" it was copied in part;{_advice(info)}"
        ) from error
    except _UNREADABLE as error:
        raise _torn(path, error, _advice(info)) from error
    if table.num_rows != episode["length"]:
        raise HandrailError(
            f"{str(path)!r}: expected {episode['length']} rows of episode {number}, found {table.num_rows};"
            + _advice(info)
        )
    return frames


def with_success(info: DatasetInfo, rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return lines of metadata with `success`, as they say it or else as their frames do: any of them.

    LeRobot's own `next.success` survives its `delete_episodes` and `split`, which drop every column of an
    episode that is not LeRobot's. `lerobot-record` keeps what `handrail_sim` says of it in the state.

    Args:
        info: What the dataset is.
        rows: As `read_episodes` returns them.
    """
    feature, places = info.features.get(SUCCESS), kept_in_state(info.robot_type, info.features)
    if feature is not None and feature.dtype in NUMBERS:
        column, places = SUCCESS, {}
    elif SUCCESS in places:
        column = STATE
    else:
        return list(rows)
    found = [dict(row) for row in rows]
    with data_files() as files:
        for row in found:
            if row.get("success") is None:
                frames = read_rows_of(info, row, [column], files)
                row["success"] = bool(np.any((frames | out_of_state(places, frames))[SUCCESS] > 0))
    return found


def _chosen(info: DatasetInfo, columns: Sequence[str] | None) -> tuple[str, ...]:
    readable = [key for key, feature in info.features.items() if feature.dtype in _READABLE]
    if columns is None:
        return tuple(readable)
    for column in columns:
        if column not in readable:
            raise unknown_name("column", column, readable)
    return tuple(columns)


def _to_numpy(column: pa.ChunkedArray, feature: Feature) -> np.ndarray:
    if feature.dtype == "string":
        return np.array([value or "" for value in column.to_pylist()], dtype=str)
    shape = () if feature.is_scalar else feature.shape
    return flat_numbers(column).astype(feature.dtype).reshape(len(column), *shape)


def _read_rows(path: Path) -> list[dict[str, Any]]:
    try:
        with pq.ParquetFile(regular(path)) as file:
            names = [name for name in file.schema_arrow.names if not name.startswith("stats/")]
            table = file.read(columns=names, use_threads=False)
        columns = [plain_values(table.column(place)) for place in range(len(names))]
        rows = [dict(zip(names, values, strict=True)) for values in zip(*columns, strict=True)]
        for row in rows:
            row["tasks"] = msgspec.convert(row, EpisodeLine).tasks or []
        return rows
    except _UNREADABLE as error:
        raise _torn(path, error) from error


def _first_odd(numbers: list[int]) -> str:
    """Return which is the first episode that is not there, or is there twice."""
    odd = next((place for place, number in enumerate(numbers) if place != number), len(numbers))
    twice = odd < len(numbers) and numbers[odd] < odd
    return f" (episode {odd - 1} twice)" if twice else f" (no episode {odd})"


def _info_content(layout: Layout) -> dict[str, Any]:
    root = str(layout.root)
    if not layout.root.is_dir():
        raise HandrailError(f"dataset {root!r}: expected a folder, found none; check the path")
    if not layout.info.is_file() and not layout.manifest.is_file():
        raise HandrailError(f"{root!r} is not a LeRobot dataset (no meta/info.json); check the path")
    try:
        content = read_json(layout.info)
        if not isinstance(content, dict):
            raise ValueError("no JSON object")
    except _UNREADABLE as error:
        advice = f" handrail-edit repair {root} rebuilds it" if layout.manifest.is_file() else _DAMAGED
        raise _torn(layout.info, error, advice) from error
    return content


def _torn(path: Path, error: Exception, advice: str = _DAMAGED) -> HandrailError:
    reason = "no such file" if isinstance(error, FileNotFoundError) else str(error).partition("\n")[0]
    return HandrailError(f"{str(path)!r} cannot be read ({reason});{advice}")


def _advice(info: DatasetInfo) -> str:
    again = " copy it again"
    return f"{again}, or see what handrail-edit repair {info.root} says" if info.from_handrail else again

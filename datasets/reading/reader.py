"""Reading any LeRobot v3.0 dataset without LeRobot: what it is, its episodes, the rows of one episode.

Pictures are not read here; `LeRobotDataset` does that.
"""

import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pyarrow as pa

from handrail.controllers.errors import HandrailError, check_known, first_line
from handrail.datasets.format.data_file import DataFiles, data_files
from handrail.datasets.format.episode_rows import EpisodeRow, plain_names, row_files, table_rows
from handrail.datasets.format.info_file import InfoFile, fill
from handrail.datasets.format.layout import VIDEO_PATH, Layout
from handrail.datasets.format.manifest import read_manifest
from handrail.datasets.format.schema import NUMBERS, Feature, features_of
from handrail.datasets.format.tables import UNREADABLE, flat_numbers, open_parquet
from handrail.datasets.reading.simulated import STATE, SUCCESS, kept_in_state, out_of_state
from handrail.datasets.storage.atomic import beside
from handrail.datasets.storage.strict_json import read_json

_DAMAGED = " the dataset is damaged"
_READABLE = (*NUMBERS, "float16", "string")


@dataclass(frozen=True)
class DatasetInfo:
    """What `meta/info.json` says."""

    root: Path
    fps: int
    """Frames a second [Hz]."""
    robot_type: str
    """The robot, or ""."""
    features: dict[str, Feature]
    """All columns, LeRobot's own included."""
    episodes: int
    frames: int
    data_path: str
    """Pattern of the data files; see `info_file.fill`."""
    video_path: str
    """Pattern of the video files."""
    from_handrail: bool
    """Whether Handrail recorded it."""

    def data_file(self, row: Mapping[str, Any]) -> str:
        """Return the path in the dataset of an episode's data file."""
        return fill(self.data_path, row["data/chunk_index"], row["data/file_index"])

    def video_file(self, row: Mapping[str, Any], camera: str) -> str:
        """Return the path in the dataset of an episode's video of a camera."""
        stream = f"videos/{camera}"
        return fill(self.video_path, row[f"{stream}/chunk_index"], row[f"{stream}/file_index"], camera)


def read_info(root: str | Path) -> DatasetInfo:
    """Read what a dataset is."""
    layout = Layout(Path(root).expanduser().absolute())
    where = str(layout.root)
    advice = f"handrail-edit repair {shlex.quote(where)}"
    if not layout.root.is_dir():
        repair = f", or {advice}" if beside(layout.root, "replaced").is_dir() else ""
        raise HandrailError(f"dataset {where!r}: expected a folder, found none; check the path{repair}")
    if not layout.info.is_file() and not layout.manifest.is_file():
        raise HandrailError(f"{where!r} is not a LeRobot dataset (no meta/info.json); check the path")
    try:
        content = read_json(layout.info)
        if not isinstance(content, dict):
            raise ValueError("no JSON object")
    except UNREADABLE as error:
        advice = f" {advice} rebuilds it" if layout.manifest.is_file() else _DAMAGED
        raise _torn(layout.info, error, advice) from error
    version = str(content.get("codebase_version"))
    if not version.startswith("v3."):
        raise HandrailError(
            f"dataset {where!r}: expected version v3.0, got {version[:60]};"
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
            features=features_of(said.features),
            episodes=said.total_episodes,
            frames=said.total_frames,
            data_path=said.data_path,
            video_path=said.video_path or VIDEO_PATH,
            from_handrail=layout.manifest.is_file(),
        )
    except UNREADABLE as error:
        raise _torn(layout.info, error) from error


def read_episodes(root: str | Path) -> list[dict[str, Any]]:
    """Read the rows of metadata of all episodes, in order.

    Returns:
        For each episode a dict: `episode_index`, `length` (frames), `tasks` (list of str),
        `dataset_from_index`, `data/chunk_index`, …, and extra columns such as `success`; no statistics.
    """
    info = read_info(root)
    rows: list[dict[str, Any]] = []
    for path in row_files(Layout(info.root)):
        try:
            with open_parquet(path) as file:
                found = table_rows(file.read(columns=plain_names(file), use_threads=False))
            for row in found:
                row["tasks"] = msgspec.convert(row, EpisodeRow).tasks or []
        except UNREADABLE as error:
            raise _torn(path, error) from error
        rows += found
    rows.sort(key=lambda row: row["episode_index"])
    numbers = [row["episode_index"] for row in rows]
    if numbers != list(range(max(len(rows), info.episodes))):
        odd = next((place for place, number in enumerate(numbers) if place != number), len(numbers))
        twice = odd < len(numbers) and numbers[odd] < odd
        which = f" (episode {odd - 1} twice)" if twice else f" (no episode {odd})"
        raise HandrailError(
            f"dataset {str(info.root)!r}: expected {info.episodes} episodes in meta/episodes,"
            f" got {len(rows)} rows{which}: it was copied in part, or is damaged;" + _advice(info)
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
    with open_dataset(root) as dataset:
        return dataset.frames(episode, columns)


@dataclass(frozen=True)
class OpenDataset:
    """A dataset that is open for several episodes: read once what it is, its files stay open."""

    info: DatasetInfo
    rows: Sequence[dict[str, Any]]
    """Rows of metadata of all episodes, in order."""
    files: DataFiles
    """Its data files that were read last."""

    def row(self, episode: int) -> dict[str, Any]:
        """Return the row of metadata of an episode."""
        if not 0 <= episode < len(self.rows):
            raise HandrailError(
                f"--episode {episode}: expected one of 0 to {len(self.rows) - 1} in {self.info.root}"
            )
        return self.rows[episode]

    def frames(self, episode: int, columns: Sequence[str] | None = None) -> dict[str, np.ndarray]:
        """Return the rows of an episode, see `read_frames`."""
        return read_rows_of(self.info, self.row(episode), columns, self.files)


@contextmanager
def open_dataset(root: str | Path) -> Iterator[OpenDataset]:
    """Provide a dataset whose files are closed in the end."""
    with data_files() as files:
        yield OpenDataset(read_info(root), read_episodes(root), files)


def read_rows_of(
    info: DatasetInfo, episode: Mapping[str, Any], columns: Sequence[str] | None, files: DataFiles
) -> dict[str, np.ndarray]:
    """Read the rows of one episode whose row of metadata is at hand; see `read_frames`."""
    readable = [key for key, feature in info.features.items() if feature.dtype in _READABLE]
    names = readable if columns is None else list(columns)
    check_known("column", names, readable)
    path, number, length = info.root / info.data_file(episode), episode["episode_index"], episode["length"]
    try:
        table = files.open(path).rows(number, names)
        frames = {name: _values(table.column(name), info.features[name]) for name in names}
    except FileNotFoundError as error:
        raise HandrailError(
            f"dataset {str(info.root)!r}: {path.relative_to(info.root)} of episode {number} is missing:"
            f" it was copied in part;{_advice(info)}"
        ) from error
    except UNREADABLE as error:
        raise _torn(path, error, _advice(info)) from error
    if table.num_rows != length:
        raise HandrailError(
            f"{str(path)!r}: expected {length} rows of episode {number}, found {table.num_rows};"
            + _advice(info)
        )
    return frames


def with_success(info: DatasetInfo, rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return rows of metadata with `success`, as they say it or else as their frames do: any of them.

    LeRobot's own `next.success` survives its `delete_episodes` and `split`, which drop every column of an
    episode that is not LeRobot's. `lerobot-record` keeps what `handrail_sim` says of it in the state.
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


def _values(column: pa.ChunkedArray, feature: Feature) -> np.ndarray:
    if feature.dtype == "string":
        return np.array([value or "" for value in column.to_pylist()], dtype=str)
    values = flat_numbers(column)
    if feature.number.kind != "f" and (column.null_count or np.isnan(values).any()):
        raise ValueError(f"{column.null_count or 'some'} rows without a value, expected {feature.dtype}")
    shape = () if feature.is_scalar else feature.shape
    return values.astype(feature.dtype).reshape(len(column), *shape)


def _torn(path: Path, error: Exception, advice: str = _DAMAGED) -> HandrailError:
    reason = "no such file" if isinstance(error, FileNotFoundError) else first_line(error)
    return HandrailError(f"{str(path)!r} cannot be read ({reason});{advice}")


def _advice(info: DatasetInfo) -> str:
    repair = f", or see what handrail-edit repair {shlex.quote(str(info.root))} says"
    return " copy it again" + repair * info.from_handrail

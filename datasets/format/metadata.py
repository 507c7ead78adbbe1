"""What a dataset knows about its episodes: one line an episode, and the totals that follow from the lines.

`info.json`, `stats.json` and `tasks.parquet` are pure functions of the manifest and the lines, so they can be
rebuilt to the byte whenever they are missing or late.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.arrow import numbers, one_list, one_scalar, strings
from handrail.datasets.format.columns import ColumnTypes, Scalar, is_extra
from handrail.datasets.format.info_fields import MOST_EPISODES, MOST_FRAMES, whole_number
from handrail.datasets.format.layout import DATA_PATH, FILES_IN_A_CHUNK, VIDEO_PATH, chunk_and_file
from handrail.datasets.format.manifest import Manifest, json_bytes
from handrail.datasets.format.path_pattern import inside
from handrail.datasets.format.schema import AUTOMATIC, Feature, video_keys
from handrail.datasets.format.stats import STATISTICS, Stats, merge_stats, stats_from_lists, stats_to_lists
from handrail.datasets.format.tables import parquet_bytes
from handrail.datasets.format.video import video_info
from handrail.datasets.storage.strict_json import parse_json, read_json

CODEBASE_VERSION = "v3.0"
_MARK = b"handrail"  # key in the metadata of a row file: sizes and hashes of the episode's files
_ORIGIN = b"handrail.origin"


class ForeignLineError(HandrailError):
    """A line of metadata that another tool wrote."""


@dataclass(frozen=True)
class FileSeal:
    """Size [byte] and SHA-256 of a file at the moment its episode was saved."""

    size: int
    sha256: str

    @classmethod
    def of(cls, path: Path) -> "FileSeal":
        """Return the seal of a file.

        Raises:
            OSError: The file cannot be read.
        """
        with open(path, "rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        return cls(path.stat().st_size, digest)


@dataclass(frozen=True)
class EpisodeRecord:
    """The line of metadata of one episode.

    Attributes:
        episode: Its number.
        start: Index of its first frame in the dataset.
        length: Number of frames.
        tasks: Its task sentences, in the order in which they first occur.
        stats: Statistics of its columns; None where they were not read.
        columns: Extra columns.
        files: Seals of its data and video files by relative path.
    """

    episode: int
    start: int
    length: int
    tasks: tuple[str, ...]
    stats: Stats | None
    columns: Mapping[str, Scalar | None]
    files: Mapping[str, FileSeal]


@dataclass(frozen=True)
class Totals:
    """What the episodes add up to.

    Attributes:
        episodes: Number of saved episodes.
        frames: Number of their frames.
        tasks: Task sentences; the place is the `task_index`.
        stats: Statistics over all frames.
    """

    episodes: int = 0
    frames: int = 0
    tasks: tuple[str, ...] = ()
    stats: Stats | None = field(default=None, compare=False)

    def with_tasks(self, tasks: tuple[str, ...]) -> tuple[str, ...]:
        """Return the task sentences after an episode: new ones are appended in their order."""
        return (*self.tasks, *(task for task in dict.fromkeys(tasks) if task not in self.tasks))

    def grown(self, record: EpisodeRecord) -> "Totals":
        """Return the totals with one more episode."""
        stats = self.stats if record.stats is None else merge_stats(self.stats, record.stats)
        return Totals(self.episodes + 1, self.frames + record.length, self.with_tasks(record.tasks), stats)


def info_bytes(
    manifest: Manifest, totals: Totals, encodings: Mapping[str, Mapping[str, Any]] | None = None
) -> bytes:
    """Return `meta/info.json`.

    Args:
        manifest: The schema.
        totals: What the episodes add up to.
        encodings: How the videos of some cameras are encoded, where that is not as Handrail does it.
    """
    features = {**manifest.features, **AUTOMATIC}
    described = {key: _info_feature(feature, manifest.fps) for key, feature in features.items()}
    for key, encoding in (encodings or {}).items():
        described[key]["info"] = dict(encoding)
    content = {
        "codebase_version": CODEBASE_VERSION,
        "fps": manifest.fps,
        "features": described,
        "total_episodes": totals.episodes,
        "total_frames": totals.frames,
        "total_tasks": len(totals.tasks),
        "chunks_size": FILES_IN_A_CHUNK,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "data_path": DATA_PATH,
        "video_path": VIDEO_PATH,
        "robot_type": manifest.robot_type,
        "splits": {"train": f"0:{totals.episodes}"} if totals.episodes else {},
    }
    return json_bytes(content)


def stats_bytes(stats: Stats) -> bytes:
    """Return `meta/stats.json`."""
    return json_bytes(stats_to_lists(stats))


def read_encodings(info: Path, manifest: Manifest) -> dict[str, Mapping[str, Any]]:
    """Return how `info.json` says that videos are encoded: another tool may have done it anew."""
    try:
        described = read_json(info)["features"]
        found = {key: described[key]["info"] for key in video_keys(manifest.features)}
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return {key: value for key, value in found.items() if isinstance(value, dict) and "video.codec" in value}


def row_bytes(manifest: Manifest, record: EpisodeRecord, types: ColumnTypes, origin: str = "") -> bytes:
    """Return the file with the metadata of one episode, as LeRobot lays it out, with Handrail's seals.

    Args:
        manifest: The schema.
        record: The episode.
        types: Of the extra columns.
        origin: SHA-256 of the line that the episode had before it was set aside and put back.
    """
    extras = {name: one_scalar(record.columns.get(name), kind) for name, kind in types.items()}
    columns = _row_columns(manifest, record) | extras | _stats_columns(record.stats or {})
    columns |= _place("meta/episodes", record.episode)
    table = pa.Table.from_arrays(list(columns.values()), names=list(columns))
    marks = {_MARK: _seals_json(record.files)} | ({_ORIGIN: origin} if origin else {})
    return parquet_bytes(table.replace_schema_metadata(marks), statistics=False)


def resealed_bytes(path: Path, files: Mapping[str, FileSeal]) -> bytes:
    """Return the file with the metadata of one episode as it is, but with other seals."""
    with pq.ParquetFile(path) as file:
        table = file.read(use_threads=False)
    marks = dict(table.schema.metadata or {}) | {_MARK: _seals_json(files)}
    return parquet_bytes(table.replace_schema_metadata(marks), statistics=False)


def read_origin(path: Path) -> str:
    """Return what the line of an episode that was put back says of the line that it had before, or ""."""
    return (pq.read_schema(path).metadata or {}).get(_ORIGIN, b"").decode()


def read_record(path: Path, with_stats: bool) -> EpisodeRecord:
    """Read the line of metadata of one episode that Handrail wrote.

    Raises:
        ForeignLineError: The file is whole, but another tool wrote it.
        OSError, pyarrow.ArrowException, ValueError, KeyError: The file is not whole, or not one line.
    """
    with pq.ParquetFile(path) as file:
        schema = file.schema_arrow
        if _MARK not in (schema.metadata or {}):
            raise ForeignLineError(
                f"{str(path)!r} was written by another tool: Handrail neither repairs nor resumes a dataset"
                " that another tool has appended to; record into another folder"
            )
        names = [name for name in schema.names if with_stats or not name.startswith("stats/")]
        rows = file.read(columns=names, use_threads=False).to_pylist()
    (row,) = rows
    seals = parse_json(schema.metadata[_MARK])
    return EpisodeRecord(
        episode=whole_number(row, "episode_index", MOST_EPISODES),
        start=whole_number(row, "dataset_from_index", MOST_FRAMES),
        length=whole_number(row, "length", MOST_FRAMES),
        tasks=tuple(map(str, row["tasks"])),
        stats=_stats_of(row) if with_stats else None,
        columns={name: row[name] for name in names if is_extra(name)},
        files={inside(name): FileSeal(*seal) for name, seal in seals.items()},
    )


def read_column_types(path: Path) -> ColumnTypes:
    """Return the types of the extra columns in a row file."""
    return {field.name: field.type for field in pq.read_schema(path) if is_extra(field.name)}


def _seals_json(files: Mapping[str, FileSeal]) -> str:
    return json.dumps({path: [seal.size, seal.sha256] for path, seal in files.items()})


def _row_columns(manifest: Manifest, record: EpisodeRecord) -> dict[str, pa.Array]:
    columns = {
        "episode_index": _whole(record.episode),
        "tasks": one_list(strings(record.tasks), (len(record.tasks),)),
        "length": _whole(record.length),
        **_place("data", record.episode),
        "dataset_from_index": _whole(record.start),
        "dataset_to_index": _whole(record.start + record.length),
    }
    for key in video_keys(manifest.features):
        columns |= _place(f"videos/{key}", record.episode)
        columns[f"videos/{key}/from_timestamp"] = one_scalar(0.0, pa.float64())
        columns[f"videos/{key}/to_timestamp"] = one_scalar(record.length / manifest.fps, pa.float64())
    return columns


def _place(stream: str, episode: int) -> dict[str, pa.Array]:
    chunk, file = chunk_and_file(episode)
    return {f"{stream}/chunk_index": _whole(chunk), f"{stream}/file_index": _whole(file)}


def _whole(value: int) -> pa.Array:
    return one_scalar(value, pa.int64())


def _stats_columns(stats: Stats) -> dict[str, pa.Array]:
    return {
        f"stats/{key}/{name}": _stats_array(column[name], pa.int64() if name == "count" else pa.float64())
        for key, column in stats.items()
        for name in STATISTICS
    }


def _stats_array(values: np.ndarray, kind: pa.DataType) -> pa.Array:
    return one_list(numbers(values.reshape(-1), kind), values.shape)


def _stats_of(row: Mapping[str, Any]) -> Stats:
    """Return the statistics in a line; what is not finite, as an earlier version wrote it, counts as 0."""
    keys = [name.removeprefix("stats/").removesuffix("/count") for name in row if name.endswith("/count")]
    stats = stats_from_lists({key: {name: row[f"stats/{key}/{name}"] for name in STATISTICS} for key in keys})
    return {
        key: {name: np.where(np.isfinite(values), values, 0) for name, values in column.items()}
        for key, column in stats.items()
    }


def _info_feature(feature: Feature, fps: int) -> dict[str, Any]:
    return feature.described | ({"info": video_info(feature, fps)} if feature.is_video else {})

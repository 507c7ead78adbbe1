"""`meta/info.json`, what LeRobot opens first: written as LeRobot does, read from anybody.

A pattern of paths in it, such as `data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet`, may come from
a stranger, and `str.format` would look up attributes, pad to gigabytes and leave the dataset's folder for
them. Only plain fields with a short width are filled in, and the path must stay inside.
"""

import re
import string
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from handrail.datasets.format.layout import DATA_PATH, FILES_IN_A_CHUNK, VIDEO_PATH, Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import Totals
from handrail.datasets.format.schema import AUTOMATIC, video_keys
from handrail.datasets.format.stats import stats_to_lists
from handrail.datasets.format.tables import tasks_bytes
from handrail.datasets.format.video import video_info
from handrail.datasets.storage.strict_json import json_bytes, read_json

CODEBASE_VERSION = "v3.0"
Episodes = Annotated[int, Meta(ge=0, le=10**7)]
Frames = Annotated[int, Meta(ge=0, le=10**12)]
Encodings = Mapping[str, Mapping[str, Any]]
"""How the videos of some cameras are encoded, where that is not as Handrail does it."""
_Rate = Annotated[int, Meta(gt=0, le=10_000)] | Annotated[float, Meta(gt=0, le=10_000)]
_Pattern = Annotated[str, Meta(min_length=1, max_length=1000)]
_NUMBER = re.compile(r"(?:0?[1-9])?d?")  # at most nine digits wide


class InfoFile(msgspec.Struct):
    """`info.json` of any LeRobot v3.0 dataset; what else it says is of no use here."""

    fps: _Rate
    """Frames a second [Hz]; LeRobot's are whole."""
    features: dict[str, dict[str, Any]]
    total_episodes: Episodes
    total_frames: Frames
    data_path: _Pattern
    video_path: _Pattern | None = None
    robot_type: str | None = None

    def __post_init__(self) -> None:
        check_pattern(self.data_path, ("chunk_index", "file_index"))
        check_pattern(self.video_path or VIDEO_PATH, ("video_key", "chunk_index", "file_index"))


def check_pattern(pattern: str, names: tuple[str, ...]) -> None:
    """Check that a pattern has no other fields than these and stays in the folder; else a ValueError."""
    for _, name, width, conversion in string.Formatter().parse(pattern):
        if name is not None and (name not in names or conversion or not _NUMBER.fullmatch(width or "")):
            raise ValueError(f"expected only {', '.join(names)} in a path, got {pattern[:60]!r}")
    fill(pattern, 0, 0, "key")


def fill(pattern: str, chunk_index: int, file_index: int, video_key: str = "") -> str:
    """Return the path of a checked pattern, relative to the dataset; else a ValueError."""
    return inside(pattern.format(chunk_index=chunk_index, file_index=file_index, video_key=video_key))


def inside(path: str) -> str:
    """Return a path relative to a dataset; a ValueError where it leaves the dataset's folder."""
    if PurePosixPath(path).is_absolute() or ".." in re.split(r"[/\\]", path) or "\0" in path:
        raise ValueError(f"expected a path inside the dataset, got {path[:60]!r}")
    return path


def info_bytes(manifest: Manifest, totals: Totals, encodings: Encodings | None = None) -> bytes:
    """Return `meta/info.json` of a dataset whose episodes add up to `totals`."""
    described = {key: feature.described for key, feature in {**manifest.features, **AUTOMATIC}.items()}
    for key in video_keys(manifest.features):
        encoding = (encodings or {}).get(key) or video_info(manifest.features[key], manifest.fps)
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


def summary_files(
    layout: Layout, manifest: Manifest, totals: Totals, encodings: Encodings
) -> dict[Path, bytes | None]:
    """Return what the summary files hold, which follow from manifest and episodes; None for one not there."""
    stats = json_bytes(stats_to_lists(totals.stats)) if totals.stats else None
    return {
        layout.tasks: tasks_bytes(totals.tasks) if totals.tasks else None,
        layout.info: info_bytes(manifest, totals, encodings),
        layout.stats: stats,
    }


def read_encodings(layout: Layout, manifest: Manifest) -> Encodings:
    """Return how `info.json` says that videos are encoded: another tool may have done it anew."""
    try:
        described = read_json(layout.info)["features"]
        found = {key: described[key]["info"] for key in video_keys(manifest.features)}
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return {key: value for key, value in found.items() if isinstance(value, dict) and "video.codec" in value}

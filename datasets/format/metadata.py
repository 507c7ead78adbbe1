"""What a dataset knows about its episodes: one line an episode, and the totals that follow from the lines.

`info.json`, `stats.json` and `tasks.parquet` are pure functions of the manifest and the lines, so they can be
rebuilt to the byte whenever they are missing or late.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from handrail.controllers.regular_file import open_regular
from handrail.datasets.format.columns import Scalar
from handrail.datasets.format.layout import DATA_PATH, FILES_IN_A_CHUNK, VIDEO_PATH
from handrail.datasets.format.manifest import Manifest, json_bytes
from handrail.datasets.format.schema import AUTOMATIC, Feature, video_keys
from handrail.datasets.format.stats import Stats, merge_stats, stats_to_lists
from handrail.datasets.format.video import video_info
from handrail.datasets.storage.strict_json import read_json

CODEBASE_VERSION = "v3.0"


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
        with open_regular(path) as file:
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
        slot: Of its volume: the first episode in its files, after which these are named.
        offset: How many frames of the volume's files are before it.
        alone: Whether it is the only one of its volume.
    """

    episode: int
    start: int
    length: int
    tasks: tuple[str, ...]
    stats: Stats | None
    columns: Mapping[str, Scalar | None]
    files: Mapping[str, FileSeal]
    slot: int
    offset: int = 0
    alone: bool = True


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


def _info_feature(feature: Feature, fps: int) -> dict[str, Any]:
    return feature.described | ({"info": video_info(feature, fps)} if feature.is_video else {})

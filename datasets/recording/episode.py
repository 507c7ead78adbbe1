"""The episode that is being recorded: rows in memory, pictures on their way into staged mp4 files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import Totals
from handrail.datasets.format.schema import Feature, check_frame, video_keys
from handrail.datasets.format.stats import Stats, column_stats
from handrail.datasets.format.video import VideoEncoder


class OpenEpisode:
    """Frames that are not saved yet; nothing of it is in the dataset until the writer publishes it."""

    def __init__(self, layout: Layout, manifest: Manifest):
        """Start an episode; the encoders start with the first frame.

        Args:
            layout: The dataset's paths.
            manifest: The schema.
        """
        self._manifest = manifest
        self._staging = layout.staging
        self._rows: dict[str, list] = {
            key: [] for key, feature in manifest.features.items() if not feature.is_video
        }
        self._encoders: dict[str, VideoEncoder] = {}
        self.tasks: list[str] = []

    @property
    def length(self) -> int:
        """Number of frames so far."""
        return len(self.tasks)

    def staged_video(self, key: str) -> Path:
        """Return the temporary mp4 of a camera."""
        return self._staging / f"{key}.mp4"

    def add(self, frame: Mapping[str, Any], task: str) -> None:
        """Add one frame."""
        if not isinstance(task, str) or not task:
            raise HandrailError(f"task: expected a sentence, got {task!r}")
        values = check_frame(frame, self._manifest.features)
        if not self._encoders:
            self._start_encoders()
        for key, encoder in self._encoders.items():
            encoder.add(values[key])
        for key, rows in self._rows.items():
            rows.append(values[key])
        self.tasks.append(task)

    def finish_videos(self) -> Stats:
        """Close every mp4, synced and counted, and return the statistics of the cameras.

        Raises:
            HandrailError: An encoder failed.
            OSError: A file cannot be synced.
        """
        return {key: encoder.finish(self.length) for key, encoder in self._encoders.items()}

    def columns(self, totals: Totals) -> dict[str, Any]:
        """Return the columns of the data file.

        Args:
            totals: The dataset before this episode.

        Returns:
            For each feature `(N,)` or `(N, d)` values in the schema's type, strings as a list; `timestamp`
            is `frame_index / fps` [s].
        """
        count, names = self.length, totals.with_tasks(tuple(self.tasks))
        places = {task: place for place, task in enumerate(names)}
        given = {key: _stacked(self._manifest.features[key], rows) for key, rows in self._rows.items()}
        frames = np.arange(count)
        return given | {
            "timestamp": frames / self._manifest.fps,
            "frame_index": frames,
            "episode_index": np.full(count, totals.episodes),
            "index": frames + totals.frames,
            "task_index": np.array([places[task] for task in self.tasks]),
        }

    def cancel(self) -> None:
        """Stop the encoders; the staged files are left for the caller to remove."""
        for encoder in self._encoders.values():
            encoder.cancel()

    def _start_encoders(self) -> None:
        for key in video_keys(self._manifest.features):
            feature = self._manifest.features[key]
            self._encoders[key] = VideoEncoder(self.staged_video(key), self._manifest.fps, feature)


def numeric_stats(columns: Mapping[str, Any]) -> Stats:
    """Return the statistics of every column that is not a string."""
    return {key: column_stats(values) for key, values in columns.items() if isinstance(values, np.ndarray)}


def _stacked(feature: Feature, rows: list) -> Any:
    if feature.dtype == "string":
        return rows
    stacked = np.stack(rows)
    return stacked[:, 0] if feature.is_scalar else stacked

"""The episode that is being recorded: rows in memory, pictures on their way into staged mp4 files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import Totals
from handrail.datasets.format.schema import check_frame, video_keys
from handrail.datasets.format.stats import Stats, column_stats
from handrail.datasets.format.video import VideoEncoder


class OpenEpisode:
    """Frames that are not saved yet; nothing of it is in the dataset until the writer publishes it."""

    def __init__(self, layout: Layout, manifest: Manifest):
        """Start an episode; the encoders start with the first frame."""
        self._manifest, self._staging = manifest, layout.staging
        self._cameras = video_keys(manifest.features)
        self._frames: list[dict[str, Any]] = []
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
        features = self._manifest.features
        values = check_frame(frame, features)
        for key in self._cameras:
            if key not in self._encoders:
                self._encoders[key] = VideoEncoder(self.staged_video(key), self._manifest.fps, features[key])
            self._encoders[key].add(values.pop(key))
        self._frames.append(values)
        self.tasks.append(task)

    def finish(self, totals: Totals) -> tuple[dict[str, Any], Stats]:
        """Close every mp4, synced and counted.

        Args:
            totals: The dataset before this episode.

        Returns:
            The columns of the data file: for each feature `(N,)` or `(N, d)` values, strings as a list;
            `timestamp` is `frame_index / fps` [s]. And the statistics of all columns and cameras.

        Raises:
            HandrailError: An encoder failed.
            OSError: A file cannot be synced.
        """
        pictures = {key: encoder.finish(self.length) for key, encoder in self._encoders.items()}
        columns: dict[str, Any] = {}
        for key, feature in self._manifest.features.items():
            values = [] if feature.is_video else [frame[key] for frame in self._frames]
            if feature.dtype == "string":
                columns[key] = values
            elif values:
                columns[key] = np.concatenate(values) if feature.is_scalar else np.stack(values)
        sentences, frames = totals.with_tasks(tuple(self.tasks)), np.arange(self.length)
        columns |= {
            "timestamp": frames / self._manifest.fps,
            "frame_index": frames,
            "episode_index": np.full(self.length, totals.episodes),
            "index": frames + totals.frames,
            "task_index": np.array([sentences.index(task) for task in self.tasks]),
        }
        numeric = {key: column_stats(each) for key, each in columns.items() if isinstance(each, np.ndarray)}
        return columns, numeric | pictures

    def cancel(self) -> None:
        """Stop the encoders; the staged files are left for the caller to remove."""
        for encoder in self._encoders.values():
            encoder.cancel()

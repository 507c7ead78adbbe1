"""Writes what a session shows into a dataset, episode by episode."""

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from handrail.collect.session.outcome import Outcome
from handrail.collect.world.env import HandrailEnv
from handrail.datasets.recording.frames import Frame, frame_row
from handrail.datasets.recording.writer import EpisodeWriter, Scalar
from handrail.datasets.storage.atomic import explained

OUTCOME = (
    *("success", "failure_reason", "seed", "started", "wall_time", "brakes", "late", "undos"),
    *("contact_onsets", "contact_periods"),
)
"""The outcome in an episode's metadata."""

_AT_ONCE = 4  # frames written in a period


class _Aside:
    """Pictures of frames that an undo may take back, in a file: minutes of them do not fit into memory.

    Args:
        folder: where the file is; it has no name, and goes with the process.
    """

    def __init__(self, folder: Path) -> None:
        with explained("cannot keep the pictures of an episode"):
            self.file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 -- open as long as the episode
        self._shapes: dict[str, tuple[int, ...]] = {}

    def put(self, frame: Frame) -> Frame:
        """Return a frame without its pictures, which replace those of its number."""
        self._shapes = {name: image.shape for name, image in frame.images.items()}
        pictures = b"".join(image.tobytes() for image in frame.images.values())
        with explained("cannot keep the pictures of an episode"):
            self.file.seek(frame.number * len(pictures))
            self.file.write(pictures)
        return replace(frame, images={})

    def take(self, frame: Frame) -> Frame:
        """Return a frame with its pictures."""
        sizes = [int(np.prod(shape)) for shape in self._shapes.values()]
        with explained("cannot read the pictures of an episode"):
            self.file.seek(frame.number * sum(sizes))
            data = np.frombuffer(self.file.read(sum(sizes)), np.uint8)
            if len(data) < sum(sizes):
                raise OSError(f"frame {frame.number}: expected {sum(sizes)} bytes, got {len(data)}")
        parts = zip(self._shapes.items(), np.split(data, np.cumsum(sizes)), strict=False)
        images = {name: part.reshape(shape) for (name, shape), part in parts}
        return replace(frame, images=images)


class Recorder:
    """Records moments as frames; an observer of a session.

    Args:
        task: what is being done, in words.
        columns: what every episode's metadata says of the session (operator, mode, …), as of its end.
    """

    writer: EpisodeWriter
    """Of the dataset: has to be said before an episode; the next one may have another."""

    def __init__(self, task: str, columns: Mapping[str, Scalar]) -> None:
        self._task, self._columns = task, columns
        self._undoable: list[Frame] = []
        self._aside: _Aside | None = None

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Drop what an episode that ended early left open."""
        self._undoable.clear()
        self._close()
        if self.writer.open_frames:
            self.writer.discard_episode()

    def see(self, frame: Frame) -> None:
        """Add a frame, once no undo can take it back."""
        del self._undoable[frame.number - self.writer.open_frames :]
        if frame.images and frame.number >= frame.safe:
            self._aside = self._aside or _Aside(self.writer.staging)
            frame = self._aside.put(frame)
        self._undoable.append(frame)
        self._add(min(frame.safe, self.writer.open_frames + _AT_ONCE))  # the loop does not wait for more

    def _add(self, safe: int) -> None:
        """Write the frames up to a number."""
        while self._undoable and self.writer.open_frames < safe:
            frame = self._undoable.pop(0)
            if self._aside and not frame.images:
                frame = self._aside.take(frame)
            self.writer.add_frame(frame_row(frame, self.writer.features), self._task)

    def _close(self) -> None:
        if self._aside:
            self._aside.file.close()
        self._aside = None

    def end(self, outcome: Outcome) -> None:
        """Save the episode with its outcome; forget it if the operator threw it away or begins it again."""
        if not outcome.kept:
            self._close()
            self.writer.discard_episode()
            return
        self._add(outcome.frames)
        self._close()
        row: dict[str, Scalar] = dict(self._columns)
        if self.writer.has_column("operator_says"):  # datasets of old have no such column
            row["operator_says"] = outcome.operator_says
        self.writer.save_episode(row | {name: getattr(outcome, name) for name in OUTCOME})

"""Writes what a session shows into a dataset, episode by episode."""

from collections.abc import Mapping

from handrail.collect.session.outcome import Outcome
from handrail.collect.world.env import HandrailEnv
from handrail.datasets.recording.frames import Frame, frame_row
from handrail.datasets.recording.writer import EpisodeWriter, Scalar

_COLUMNS = (
    *("success", "failure_reason", "seed", "started", "wall_time", "brakes", "late", "undos"),
    *("contact_onsets", "contact_periods"),
)
"""What an episode's metadata says of its outcome."""


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

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Drop what an episode that ended early left open."""
        self._undoable.clear()
        if self.writer.open_frames:
            self.writer.discard_episode()

    def see(self, frame: Frame) -> None:
        """Add a frame, once no undo can take it back."""
        del self._undoable[frame.number - self.writer.open_frames :]
        self._undoable.append(frame)
        self._add(frame.safe)

    def _add(self, safe: int) -> None:
        """Write the frames up to a number."""
        while self._undoable and self.writer.open_frames < safe:
            self.writer.add_frame(frame_row(self._undoable.pop(0)), self._task)

    def end(self, outcome: Outcome) -> None:
        """Save the episode with its outcome; forget it if the operator threw it away or begins it again."""
        if not outcome.kept:
            self.writer.discard_episode()
            return
        self._add(outcome.frames)
        row: dict[str, Scalar] = dict(self._columns)
        if self.writer.has_column("operator_says"):  # datasets of old have no such column
            row["operator_says"] = outcome.operator_says
        self.writer.save_episode(row | {name: getattr(outcome, name) for name in _COLUMNS})

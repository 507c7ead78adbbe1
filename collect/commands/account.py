"""What came of a recording, as it goes and at its end."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from rich.table import Table

from handrail.collect.commands.target import next_commands
from handrail.collect.config import RecordConfig
from handrail.collect.operators.catalogue import OPERATORS
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.outcome import Outcome
from handrail.datasets.editing.pack_config import packing_advice
from handrail.datasets.presentation.terminal import Terminal

_DROPPED: dict[EpisodeEvent | None, str] = {
    None: "practice",
    EpisodeEvent.DISCARD: "thrown away",
    EpisodeEvent.RESTART: "begun again",
    EpisodeEvent.QUIT: "not finished",
}


@dataclass
class RecordingLog:
    """What has been recorded in this run, and what the operator did not want to keep.

    Attributes:
        outcomes: of the episodes that were kept.
        dropped: of the others.
        attempt: how many of the next number the operator has thrown away.
        trouble: what ended the run before its time.
        exit_code: of the run.
        wall_time: of the run, where that is not the sum of its episodes' [s].
    """

    outcomes: list[Outcome] = field(default_factory=list)
    dropped: list[Outcome] = field(default_factory=list)
    attempt: int = 0
    trouble: str = ""
    exit_code: int = 0
    wall_time: float = 0.0

    def add(self, outcome: Outcome) -> None:
        """Count an episode; one thrown away is tried again elsewhere, one begun again is not."""
        (self.outcomes if outcome.kept else self.dropped).append(outcome)
        another = outcome.practice or outcome.ended_by is EpisodeEvent.DISCARD
        self.attempt = 0 if outcome.kept else self.attempt + another

    @property
    def words(self) -> str:
        """How it stands."""
        successes = sum(outcome.success for outcome in self.outcomes)
        counts = Counter(None if outcome.practice else outcome.ended_by for outcome in self.dropped)
        dropped = (f", {counts[event]} {word}" for event, word in _DROPPED.items() if counts[event])
        return f"{successes}/{len(self.outcomes)} succeeded" + "".join(dropped)


def report(
    config: RecordConfig, root: Path, episodes: int, frames: int, log: RecordingLog, console: Terminal
) -> None:
    """Say what came of a recording.

    Args:
        config: of the recording.
        root: the dataset's folder.
        episodes: number of its episodes.
        frames: and of their frames.
        log: of this run.
        console: to say it on.
    """
    if log.trouble:
        console.print(f"error: {log.trouble}", style="bold red")
    if log.outcomes:
        console.print(_summary(config, log))
    for outcome in log.dropped:
        why = _DROPPED[None if outcome.practice else outcome.ended_by]
        console.print(f"not saved: {why}, seed {outcome.seed}")
    if not episodes:
        console.print("no episode was saved: nothing is left behind")
        return
    console.print(f"{episodes} episodes, {frames} frames in {root}")
    if advice := packing_advice(root):
        console.print(advice)
    if OPERATORS.find(config.operator).interactive and log.outcomes:
        console.print(*next_commands(root).splitlines(), sep="\n")


def _summary(config: RecordConfig, log: RecordingLog) -> Table:
    outcomes = log.outcomes
    simulated = sum(outcome.seconds for outcome in outcomes)
    wall = log.wall_time or sum(outcome.wall_time for outcome in outcomes)
    distance = min(outcome.smallest_distance for outcome in outcomes)
    contacts = sum(outcome.contact_onsets for outcome in outcomes)
    periods = sum(outcome.contact_periods for outcome in outcomes)
    rows = {
        "task, mode": f"{config.task}, {config.mode_name}",
        "success": log.words,
        "recorded": f"{simulated:.1f} s in {wall:.1f} s: {simulated / wall:.1f} × real time",
        "smallest distance": f"{distance:.3f} m",
        "contacts begun": f"{contacts}, {periods} periods in contact",
        "braked updates": str(sum(outcome.brakes for outcome in outcomes)),
    }
    spent = {part: sum(outcome.spent.get(part, 0.0) for outcome in outcomes) for part in outcomes[0].spent}
    frames = sum(outcome.frames for outcome in outcomes)
    rows["time a frame"] = ", ".join(f"{part} {1e3 * time / frames:.2f} ms" for part, time in spent.items())
    table = Table(show_header=False, box=None)
    for name, value in rows.items():
        table.add_row(name, value)
    return table

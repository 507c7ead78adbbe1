"""The account of a recording, as it goes and at its end."""

import shlex
import shutil
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from rich.table import Table

from handrail.collect.config import RecordConfig
from handrail.collect.operators.catalogue import OPERATORS
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.outcome import Outcome
from handrail.controllers.errors import FAILED, INTERRUPTED, HandrailError
from handrail.datasets.editing.config import packing_advice
from handrail.datasets.presentation.terminal import Terminal

_DROPPED = {
    EpisodeEvent.DISCARD: "thrown away",
    EpisodeEvent.RESTART: "begun again",
    EpisodeEvent.QUIT: "not finished",
}
_NEXT = ("handrail-inspect {root}", "handrail-replay {root}", "handrail-train {root} --output {root}_policy")


def _why_dropped(outcome: Outcome) -> str:
    return "practice" if outcome.practice or not outcome.ended_by else _DROPPED[outcome.ended_by]


@dataclass
class RecordingLog:
    """The episodes recorded in this run, and those that the operator did not keep."""

    outcomes: list[Outcome] = field(default_factory=list)
    """Of the episodes that were kept."""
    dropped: list[Outcome] = field(default_factory=list)
    trouble: str = ""
    """The reason why the run ended early."""
    kept: bool = False
    """Whether episodes wait beside the dataset, for the same command to go on."""
    exit_code: int = 0
    wall_time: float = 0.0
    """Of the run, where that is not the sum of its episodes' [s]."""

    def add(self, outcome: Outcome) -> None:
        """Count an episode."""
        (self.outcomes if outcome.kept else self.dropped).append(outcome)

    @contextmanager
    def noting(self, interrupted: str = "") -> Iterator[None]:
        """Keep why a block ends before its time, with words for an interrupt."""
        try:
            yield
        except KeyboardInterrupt:
            self.trouble, self.exit_code = f"interrupted; {interrupted}", INTERRUPTED
        except HandrailError as error:
            self.trouble, self.exit_code = str(error), FAILED

    @property
    def words(self) -> str:
        """How it stands."""
        successes = sum(outcome.success for outcome in self.outcomes)
        dropped = Counter(map(_why_dropped, self.dropped)).items()
        return ", ".join(
            [f"{successes}/{len(self.outcomes)} succeeded", *(f"{count} {why}" for why, count in dropped)]
        )

    def report(self, config: RecordConfig, root: Path, episodes: int, frames: int, console: Terminal) -> None:
        """Say what came of it.

        Args:
            config: of the recording.
            root: the dataset's folder.
            episodes: number of all its episodes.
            frames: and of their frames.
            console: to say it on.
        """
        if self.trouble:
            console.print(f"error: {self.trouble}", style="bold red")
        if self.outcomes:
            console.print(self._summary(config))
        for outcome in self.dropped:
            console.print(f"not saved: {_why_dropped(outcome)}, seed {outcome.seed}")
        if not episodes:
            if not self.kept:
                console.print("no episode was saved: nothing is left behind")
            return
        console.print(f"{episodes} episodes, {frames} frames in {root}")
        if advice := packing_advice(root):
            console.print(advice)
        if OPERATORS.find(config.operator).interactive and self.outcomes:
            console.print("Next:", *(f"  {command}" for command in next_commands(root)), sep="\n")

    def _summary(self, config: RecordConfig) -> Table:
        outcomes = self.outcomes
        simulated = sum(outcome.seconds for outcome in outcomes)
        wall = self.wall_time or sum(outcome.wall_time for outcome in outcomes)
        contacts = sum(outcome.contact_onsets for outcome in outcomes)
        periods = sum(outcome.contact_periods for outcome in outcomes)
        frames = sum(outcome.frames for outcome in outcomes)
        spent = {
            part: sum(outcome.spent.get(part, 0.0) for outcome in outcomes) for part in outcomes[0].spent
        }
        table = Table(show_header=False, box=None)
        table.add_row("task, mode", f"{config.task}, {config.mode_name}")
        table.add_row("success", self.words)
        table.add_row("recorded", f"{simulated:.1f} s in {wall:.1f} s: {simulated / wall:.1f} × real time")
        table.add_row("smallest distance", f"{min(outcome.smallest_distance for outcome in outcomes):.3f} m")
        table.add_row("contacts begun", f"{contacts}, {periods} periods in contact")
        table.add_row("braked updates", str(sum(outcome.brakes for outcome in outcomes)))
        table.add_row(
            "time a frame", ", ".join(f"{part} {1e3 * time / frames:.2f} ms" for part, time in spent.items())
        )
        return table


def next_commands(root: Path) -> list[str]:
    """Return what to try with a dataset, a command a line."""
    return [command_prefix() + command.format(root=_from_here(root)) for command in _NEXT]


def command_prefix() -> str:
    """Return what to write before a command: nothing where the shell finds it, else the folder it is in."""
    if shutil.which("handrail-record"):
        return ""
    return f"{_from_here(Path(sys.executable).parent)}/"


def _from_here(path: Path) -> str:
    return shlex.quote(str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path))

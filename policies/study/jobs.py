"""The jobs of a study: what each needs, and where its files lie. A job that is done is not done again."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from handrail.policies.study.design import MIXED, Beside, Rounds, StudyDesign


@dataclass(frozen=True)
class StudyCell:
    """One dataset: a task in a mode, one draw."""

    task: str
    mode: str  # or the way in which the time of a round is spent
    draw: int
    before: "StudyCell | None" = None
    """That of the round before: its policy drives here, and what is learnt here is added to its data."""

    @property
    def rounds(self) -> "tuple[StudyCell, ...]":
        """The cells of all rounds so far; a policy learns from the data of all of them."""
        return (*(self.before.rounds if self.before else ()), self)

    @property
    def kind(self) -> str:
        """Its kind, for any task and draw: `ee`, or `whole-2` of the second round."""
        return f"{self.mode}-{len(self.rounds) - 1}" if self.before else self.mode

    @property
    def name(self) -> str:
        """A name for files and logs: `reach/ee/3`."""
        return f"{self.task}/{self.kind}/{self.draw}"

    def mode_at(self, share: float) -> str:
        """Return the mode in which is recorded when a share of the whole is there."""
        modes = self.mode.split(MIXED)
        return modes[min(int(share * len(modes)), len(modes) - 1)]


@dataclass(frozen=True)
class StudyPolicy:
    """A policy of a cell's dataset."""

    cell: StudyCell
    actions: Literal["realised", "intent"] = "realised"  # joint velocities, or the operator's intent
    budget: Literal["time", "number"] = "time"  # the same operator's time, or number of demonstrations
    minutes: float = 0.0  # of the operator's time; 0 for the task's

    @property
    def label(self) -> str:
        """Its name in an evaluation: the mode, and its special features."""
        intent = " intent" if self.actions == "intent" else ""
        size = f" {self.minutes:g} min" if self.minutes else ""
        return self.cell.kind + intent + (" same number" if self.budget == "number" else "") + size

    @property
    def kind(self) -> str:
        """The label that tells it from the other policies of its dataset."""
        return f"{self.actions}-{self.budget}" + (f"-{self.minutes:g}" if self.minutes else "")

    @property
    def name(self) -> str:
        """A name for files and logs."""
        return f"{self.cell.name}/{self.kind}"


@dataclass(frozen=True)
class StudyJob:
    """One piece of work: collect a cell's dataset, or train and evaluate a policy."""

    cell: StudyCell
    policy: StudyPolicy | None = None  # None collects
    robust: bool = False  # whether the policy also goes through the further conditions

    @property
    def name(self) -> str:
        """A name for files and logs; unique."""
        return f"policy/{self.policy.name}" if self.policy else f"collect/{self.cell.name}"

    @property
    def needs(self) -> tuple[str, ...]:
        """Names of the jobs that come before."""
        if self.policy:
            return tuple(f"collect/{each.name}" for each in self.cell.rounds)
        return (self.before.name,) if self.before else ()

    @property
    def before(self) -> "StudyJob | None":
        """The job of the policy of the round before."""
        before = self.cell.before
        return StudyJob(before, StudyPolicy(before, "intent")) if before else None


def jobs(design: StudyDesign) -> list[StudyJob]:
    """Return all jobs, what matters most first: draw by draw the main design, then what is beside it."""
    return [job for draw in range(design.draws) for job in _draw(design, draw)]


def _draw(design: StudyDesign, draw: int) -> Iterator[StudyJob]:
    """Yield the jobs of a draw: after each draw what is done is balanced."""
    if rounds := design.rounds:
        for cell in _cells(design, rounds, draw):
            yield from (StudyJob(cell), StudyJob(cell, StudyPolicy(cell, "intent")))
        return
    robust = design.robustness is not None and draw < design.robustness.draws
    beside = design.beside or Beside()
    cells = [[StudyCell(task, mode, draw) for mode in design.modes] for task in design.tasks]
    for each in cells:
        yield from map(StudyJob, each)
        yield from (StudyJob(cell, StudyPolicy(cell), robust) for cell in each)
    for cell in (cell for each in cells for cell in each):
        for minutes in design.tasks[cell.task].sizes:
            yield StudyJob(cell, StudyPolicy(cell, minutes=minutes))
        if draw < beside.draws and cell.mode in beside.intents:
            yield StudyJob(cell, StudyPolicy(cell, "intent"), robust)
        if draw < beside.same_number and cell.mode in (beside.numbered or design.modes):
            yield StudyJob(cell, StudyPolicy(cell, budget="number"))


def _cells(design: StudyDesign, rounds: Rounds, draw: int) -> Iterator[StudyCell]:
    """Yield the cells of a draw, task by task: with which all begin, then round by round."""
    for task in design.tasks:
        yield (base := StudyCell(task, design.baseline, draw))
        last = dict.fromkeys(rounds.ways, base)
        for _ in range(rounds.count):
            last = {way: StudyCell(task, way, draw, before) for way, before in last.items()}
            yield from last.values()


@dataclass(frozen=True)
class StudyLayout:
    """Where everything lies in a study's folder.

    What is large is in `datasets` and `policies`, and may go: what is done stays done without it.
    """

    root: Path

    @property
    def designs(self) -> Path:
        """Return the file of the designs with which the study was run."""
        return self.root / "designs.json"

    def dataset(self, cell: StudyCell) -> Path:
        """Return the folder of a dataset."""
        return self.root / "datasets" / cell.name

    def merged(self, cell: StudyCell) -> Path:
        """Return the folder of the data of all rounds up to a cell's, there while a policy learns."""
        return self.root / "merged" / cell.name

    def policy(self, policy: StudyPolicy) -> Path:
        """Return the folder of a training."""
        return self.root / "policies" / policy.name

    def evaluation(self, policy: StudyPolicy, what: str) -> Path:
        """Return the file of a policy's rollouts: `nominal`, `disturbed`, `protected`, `after-5000`."""
        return self.root / "evaluations" / policy.cell.name / what / f"{policy.kind}.json"

    def begun(self, job: StudyJob) -> Path:
        """Return the file that says with which settings a job was begun."""
        return self.root / "begun" / f"{job.name}.json"

    def done(self, job: StudyJob) -> Path:
        """Return the file that says that a job is done, with which settings, and what came of it."""
        return self.root / "done" / f"{job.name}.json"

    def log(self, job: StudyJob) -> Path:
        """Return the file of what a job says."""
        return self.root / "logs" / f"{job.name}.log"

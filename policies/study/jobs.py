"""The jobs of a study: what each needs, and where its files lie. A job that is done is not done again."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from handrail.policies.study.design import StudyDesign

Actions = Literal["realised", "intent"]
Budget = Literal["time", "number"]
CONDITIONS = ("nominal", "disturbed", "protected")


@dataclass(frozen=True)
class StudyCell:
    """What is collected as one dataset: a task in a mode, one draw."""

    task: str
    mode: str
    draw: int

    @property
    def name(self) -> str:
        """A name for files and logs: `reach/ee/3`."""
        return f"{self.task}/{self.mode}/{self.draw}"


@dataclass(frozen=True)
class StudyPolicy:
    """What one policy is trained on and what it writes.

    Attributes:
        cell: whose dataset.
        actions: `realised` joint velocities, or the operator's `intent`.
        budget: how much of the dataset: the same operator's `time`, or the same `number` of demonstrations.
    """

    cell: StudyCell
    actions: Actions = "realised"
    budget: Budget = "time"

    @property
    def label(self) -> str:
        """What an evaluation calls it: the mode, and what is special about it."""
        words = [self.cell.mode, self.actions if self.actions != "realised" else ""]
        return " ".join(filter(None, [*words, "same number" if self.budget == "number" else ""]))

    @property
    def name(self) -> str:
        """A name for files and logs."""
        return f"{self.cell.name}/{self.actions}-{self.budget}"


@dataclass(frozen=True)
class StudyJob:
    """One piece of work: collect a dataset, or train and evaluate a policy.

    Attributes:
        name: of the job, unique.
        cell: whose dataset it collects or learns from.
        policy: to train and evaluate; None collects.
        robust: whether the policy also goes through the further conditions.
    """

    name: str
    cell: StudyCell
    policy: StudyPolicy | None = None
    robust: bool = False

    @property
    def needs(self) -> tuple[str, ...]:
        """Names of the jobs that come before."""
        return (f"collect/{self.cell.name}",) if self.policy else ()


def jobs(design: StudyDesign) -> list[StudyJob]:
    """Return all jobs, what matters most first: draw by draw the main design, then what is beside it."""
    return [job for draw in range(design.draws) for job in _draw(design, draw)]


def _draw(design: StudyDesign, draw: int) -> Iterator[StudyJob]:
    """Yield the jobs of a draw: after each draw what is done is balanced."""
    robust = design.robustness is not None and draw < design.robustness.draws
    cells = {task: [StudyCell(task, mode, draw) for mode in design.modes] for task in design.tasks}
    for task in design.tasks:
        yield from map(_collect, cells[task])
        yield from (_policy(StudyPolicy(cell), robust) for cell in cells[task])
    for cell in (cell for task in design.tasks for cell in cells[task]):
        if design.beside and draw < design.beside.draws and cell.mode in design.beside.intents:
            yield _policy(StudyPolicy(cell, "intent"), robust)
        if design.beside and draw < design.beside.same_number:
            yield _policy(StudyPolicy(cell, budget="number"), robust=False)


def _collect(cell: StudyCell) -> StudyJob:
    return StudyJob(f"collect/{cell.name}", cell)


def _policy(policy: StudyPolicy, robust: bool) -> StudyJob:
    return StudyJob(f"policy/{policy.name}", policy.cell, policy, robust)


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

    def policy(self, policy: StudyPolicy) -> Path:
        """Return the folder of a training."""
        return self.root / "policies" / policy.name

    def evaluation(self, policy: StudyPolicy, what: str) -> Path:
        """Return the file of a policy's rollouts: `nominal`, `disturbed` or `protected`."""
        return self.root / "evaluations" / policy.cell.name / what / f"{policy.actions}-{policy.budget}.json"

    def begun(self, job: StudyJob) -> Path:
        """Return the file that says with which settings a job was begun."""
        return self.root / "begun" / f"{job.name}.json"

    def done(self, job: StudyJob) -> Path:
        """Return the file that says that a job is done, with which settings, and what came of it."""
        return self.root / "done" / f"{job.name}.json"

    def log(self, job: StudyJob) -> Path:
        """Return the file of what a job says."""
        return self.root / "logs" / f"{job.name}.log"

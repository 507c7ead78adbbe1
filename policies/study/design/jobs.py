"""The jobs of a study: what each needs, and where its files lie. A job that is done is not done again."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Literal

from handrail.collect.operators.modes import MODES
from handrail.policies.study.design.design import StudyDesign

Actions = Literal["realised", "intent"]
CONDITIONS = ("nominal", "disturbed", "protected")


@dataclass(frozen=True)
class Cell:
    """What is collected as one dataset: a task in a mode, by operators as human as `noise` says."""

    task: str
    mode: str
    noise: float = 1.0

    @property
    def name(self) -> str:
        """A name for files and logs: `reach/ee`, or `reach/ee@0.5` where the noise is not 1."""
        return f"{self.task}/{self.mode}" + (f"@{self.noise:g}" if self.noise != 1.0 else "")


@dataclass(frozen=True)
class StudyPolicy:
    """What one policy is trained on and what it writes.

    Attributes:
        cell: whose dataset.
        actions: `realised` joint velocities or the operator's `intent`.
        budget: `time` or `number`: how much of the dataset.
        seed: of the training.
    """

    cell: Cell
    actions: Actions
    budget: str
    seed: int

    @property
    def label(self) -> str:
        """What an evaluation calls it: the mode, and what is special about it."""
        words = [self.cell.mode, "intent" if self.actions == "intent" else ""]
        return " ".join(filter(None, [*words, "same number" if self.budget == "number" else ""]))

    @property
    def name(self) -> str:
        """A name for files and logs."""
        return f"{self.cell.name}/{self.actions}-{self.budget}-{self.seed}"


@dataclass(frozen=True)
class Job:
    """One piece of work: collect a dataset; train and evaluate a policy; compare the modes of a task.

    Attributes:
        name: of the job, unique.
        needs: names of the jobs that come before.
        cell: to collect.
        policy: to train and evaluate.
        task: to compare.
        robust: whether the policy also goes through the further conditions.
    """

    name: str
    needs: tuple[str, ...] = ()
    cell: Cell | None = None
    policy: StudyPolicy | None = None
    task: str = ""
    robust: bool = False


def jobs(design: StudyDesign) -> list[Job]:
    """Return all jobs, what matters most first: the main design seed by seed, then the sweep."""
    found: list[Job] = []
    for seed, task in product(design.seeds, design.tasks):
        cells = [Cell(task, mode) for mode in design.modes]
        if seed == design.seeds[0]:
            found += map(_collect, cells)
        policies = [
            policy for budget in design.budgets for cell in cells for policy in _policies(cell, budget, seed)
        ]
        robust = design.robustness is not None and seed in design.robustness.seeds
        found += [_policy(policy, robust and policy.budget == design.budgets[0]) for policy in policies]
    found += [_compare(task, found) for task in design.tasks]
    return found + list(_sweep(design))


def _sweep(design: StudyDesign) -> Iterator[Job]:
    if not design.sweep:
        return
    cells = [
        Cell(task, mode, noise)
        for noise, task, mode in product(design.sweep.noises, design.sweep.tasks, design.modes)
        if noise != 1.0
    ]
    yield from map(_collect, cells)
    for seed, cell in product(design.sweep.seeds, cells):
        yield from (_policy(policy, robust=False) for policy in _policies(cell, design.budgets[0], seed))


def _policies(cell: Cell, budget: str, seed: int) -> list[StudyPolicy]:
    completed = MODES[cell.mode].controller == "mpc"  # the others leave nothing for an intent to complete
    spaces: tuple[Actions, ...] = ("realised", "intent") if completed else ("realised",)
    return [StudyPolicy(cell, actions, budget, seed) for actions in spaces]


def _collect(cell: Cell) -> Job:
    return Job(f"collect/{cell.name}", cell=cell)


def _policy(policy: StudyPolicy, robust: bool) -> Job:
    return Job(f"policy/{policy.name}", (f"collect/{policy.cell.name}",), policy=policy, robust=robust)


def _compare(task: str, others: list[Job]) -> Job:
    mine = [
        job.name
        for job in others
        if (job.cell and job.cell.task == task) or (job.policy and job.policy.cell.task == task)
    ]
    return Job(f"compare/{task}", tuple(mine), task=task)


@dataclass(frozen=True)
class Layout:
    """Where everything lies in a study's folder."""

    root: Path

    def dataset(self, cell: Cell) -> Path:
        """Return the folder of a dataset."""
        return self.root / "datasets" / cell.name

    def policy(self, policy: StudyPolicy) -> Path:
        """Return the folder of a training."""
        return self.root / "policies" / policy.name

    def evaluation(self, policy: StudyPolicy, what: str) -> Path:
        """Return the file of a policy's rollouts: `nominal`, `disturbed` or `protected`."""
        return (
            self.root
            / "evaluations"
            / policy.cell.name
            / what
            / f"{policy.actions}-{policy.budget}-{policy.seed}.json"
        )

    def comparison(self, task: str) -> Path:
        """Return the folder of a task's report."""
        return self.root / "comparisons" / task

    def begun(self, job: Job) -> Path:
        """Return the file that says with which settings a job was begun."""
        return self.root / "begun" / f"{job.name}.json"

    def done(self, job: Job) -> Path:
        """Return the file that says that a job is done, and with which settings."""
        return self.root / "done" / f"{job.name}.json"

    def log(self, job: Job) -> Path:
        """Return the file of what a job says."""
        return self.root / "logs" / f"{job.name}.log"

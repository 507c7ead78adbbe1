"""What the rollouts of a study are, policy by policy, read from the small files that its jobs leave."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.statistics.paired import wilson
from handrail.datasets.statistics.resampling import Interval
from handrail.datasets.statistics.student import Estimate, student, variance_of_share
from handrail.policies.study.design.jobs import StudyJob, StudyPolicy
from handrail.policies.study.design.progress import StudyProgress, read_json

MEASURES = {
    "success": "success",
    "contact": "rollouts with contact",
    "clean": "success without contact",
}


@dataclass(frozen=True)
class Driven:
    """What one policy did under one treatment.

    Attributes:
        policy: which.
        treatment: what disturbs or protects, `pushed` or `filter`; "" for neither.
        rollouts: lines of the evaluation's file, by seed.
    """

    policy: StudyPolicy
    treatment: str
    rollouts: Mapping[int, Mapping[str, Any]]

    def values(self, measure: str = "success") -> FloatArray:
        """Return one of `MEASURES` of each rollout, 0 or 1, (R,), by seed."""
        rows = [self.rollouts[seed] for seed in sorted(self.rollouts)]
        touched = np.array([row.get("contacts", 0) > 0 for row in rows], bool)
        succeeded = np.array([row["success"] for row in rows], bool)
        found = {"success": succeeded, "contact": touched, "clean": succeeded & ~touched}
        return found[measure].astype(float)

    @property
    def failures(self) -> Counter[str]:
        """Where and how rollouts failed, `lift, stalled`, and how many of each."""
        failed = [row for row in self.rollouts.values() if not row["success"]]
        return Counter(_where(row) for row in failed)


def _where(row: Mapping[str, Any]) -> str:
    """Return the stage in which a rollout failed and how it ended, or else the reason."""
    said = [str(row[name]) for name in ("stage", "ended") if row.get(name)]
    return ", ".join(said) or str(row.get("failure_reason") or "unknown")


@dataclass(frozen=True)
class Condition:
    """All draws of one kind of policy under one treatment.

    Attributes:
        task: which.
        label: of the policies.
        treatment: as of its draws.
        draws: by number.
    """

    task: str
    label: str
    treatment: str
    draws: Mapping[int, Driven]

    @property
    def shares(self) -> dict[int, float]:
        """Success of each draw's policy."""
        return {draw: float(each.values().mean()) for draw, each in self.draws.items()}

    def least(self, measure: str = "success") -> float:
        """Return the variance of a draw's share if only its rollouts were drawn anew."""
        values = [each.values(measure) for each in self.draws.values()]
        together = np.concatenate(values)
        return variance_of_share(together.sum(), len(together), round(len(together) / len(values)))

    @cached_property
    def success(self) -> Estimate:
        """Mean over draws."""
        return student(list(self.shares.values()), self.least())

    @property
    def interval(self) -> Interval:
        """95 % of the success: Student's t over draws; of a single one Wilson's, for this very policy."""
        if self.success.interval:
            low, high = self.success.interval
            return max(0.0, low), min(1.0, high)
        values = self.rolled()
        return wilson(float(values.sum()), len(values))

    def rolled(self, measure: str = "success") -> FloatArray:
        """Return one measure of all rollouts."""
        return np.concatenate([each.values(measure) for each in self.draws.values()])

    def mean(self, name: str) -> float:
        """Return the mean of a number of all rollouts."""
        rows = [row for each in self.draws.values() for row in each.rollouts.values()]
        return float(np.mean([row.get(name, 0.0) for row in rows]))

    @property
    def failures(self) -> Counter[str]:
        """Where and how rollouts failed."""
        return sum((each.failures for each in self.draws.values()), Counter[str]())


@dataclass(frozen=True)
class Results:
    """All that is done of a study.

    Attributes:
        progress: of the study.
        conditions: by task, label and treatment.
    """

    progress: StudyProgress
    conditions: Mapping[tuple[str, str, str], Condition]

    def find(self, task: str, label: str, treatment: str = "") -> Condition | None:
        """Return a condition; None where nothing of it is done."""
        return self.conditions.get((task, label, treatment))

    def of_task(self, task: str, treated: bool = False) -> list[Condition]:
        """Return the conditions of a task, disturbed and protected ones or the others."""
        return [
            each
            for (name, _, treatment), each in self.conditions.items()
            if (name, bool(treatment)) == (task, treated)
        ]

    def collected(self, task: str, mode: str) -> list[dict[str, Any]]:
        """Return what was collected in a mode, draw by draw."""
        jobs = [
            job
            for job in self.progress.jobs
            if job.policy is None and (job.cell.task, job.cell.mode) == (task, mode)
        ]
        return [note["result"] for job in jobs if (note := self.progress.note(job))]

    def trained(self, condition: Condition) -> list[dict[str, Any]]:
        """Return what came of the trainings of a condition's policies."""
        wanted = [each.policy for each in condition.draws.values()]
        jobs = [job for job in self.progress.jobs if job.policy in wanted]
        return [note["result"] for job in jobs if (note := self.progress.note(job))]


def gather(progress: StudyProgress) -> Results:
    """Return what is done of a study: the main design first, in the order of its modes."""
    found: dict[tuple[str, str, str], dict[int, Driven]] = {}
    for job in progress.jobs:
        for each in _driven(job, progress):
            cell = each.policy.cell
            key = (cell.task, each.policy.label, each.treatment)
            found.setdefault(key, {})[cell.draw] = each
    ordered = sorted(found.items(), key=lambda item: _place(item[1]))
    return Results(progress, {key: Condition(*key, draws) for key, draws in ordered})


def _place(draws: Mapping[int, Driven]) -> tuple[bool, bool]:
    """Sort the main design before what is beside it; else as the jobs come."""
    policy = next(iter(draws.values())).policy
    return policy.budget == "number", policy.actions != "realised"


def _driven(job: StudyJob, progress: StudyProgress) -> Iterable[Driven]:
    for file in progress.rollouts(job):
        for label, (entry,) in read_json(file)["arms"].items():
            assert job.policy is not None
            rollouts = {row["seed"]: row for row in entry["rollouts"]}
            yield Driven(job.policy, label.removeprefix(job.policy.label).strip(), rollouts)

"""The rollouts of a study, policy by policy, read from the small files that its jobs leave."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.comparison.evaluations import Condition, Policy, Rollout, read_evaluations
from handrail.datasets.statistics.contrast import SHARE, Measure, Value
from handrail.datasets.statistics.paired import wilson
from handrail.datasets.statistics.replicates import chance_of_shares, student
from handrail.policies.study.jobs import StudyPolicy
from handrail.policies.study.progress import StudyProgress

MEASURES = {
    "success": Measure("success", "success", SHARE),
    "contact": Measure("contact", "rollouts with contact", SHARE),
    "clean": Measure("clean", "success without contact", SHARE),
}


def _where(row: Rollout) -> str:
    """Return the stage in which a rollout failed and how it ended, or else the reason."""
    said = [str(row[name]) for name in ("stage", "ended") if row.get(name)]
    return ", ".join(said) or str(row.get("failure_reason") or "unknown")


@dataclass(frozen=True)
class StudyCondition(Condition):
    """All draws of one kind of policy under one treatment."""

    task: str
    treatment: str  # what disturbs or protects, `pushed` or `filter`; "" for neither
    learners: tuple[StudyPolicy, ...]  # what each policy was trained on

    @cached_property
    def draws(self) -> Mapping[int, Policy]:
        """The policies by draw."""
        return {policy.draw: policy for policy in self.policies}

    def share(self, draw: int, measure: str = "success") -> float:
        """Return the share of one draw's rollouts."""
        return float(self.draws[draw].run(measure).values.mean())

    @property
    def shares(self) -> dict[int, float]:
        """Success of each draw's policy."""
        return {draw: self.share(draw) for draw in self.draws}

    @cached_property
    def value(self) -> Value:
        """Success: mean over draws, 95 % by Student's t; of a single draw Wilson's, for this very policy."""
        found, rolled = student(list(self.shares.values()), chance_of_shares(self.runs())), self.rolled()
        low, high = found.interval or wilson(float(rolled.sum()), len(rolled))
        named: dict[str, Any] = vars(found) | {"interval": (max(0.0, low), min(1.0, high))}
        label, values = f"{self.label} {self.treatment}".strip(), np.array(list(self.shares.values()))
        return Value(**named, measure=MEASURES["success"], label=label, scope=self.task, values=values)

    def rolled(self, measure: str = "success") -> FloatArray:
        """Return one measure of all rollouts."""
        return np.concatenate([run.values for run in self.runs(measure)])

    def mean(self, name: str) -> float:
        """Return the mean of a number of all rollouts."""
        return float(np.mean([row.get(name, 0.0) for row in self.rollouts]))

    @property
    def failures(self) -> Counter[str]:
        """Where and how rollouts failed, `lift, stalled`, and how many of each."""
        return Counter(_where(row) for row in self.rollouts if not row["success"])

    def beside(self, other: "StudyCondition") -> "StudyCondition | None":
        """Return the same draws and scenes as another condition has; None where one is missing."""
        found = []
        for policy in other.policies:
            mine = self.draws.get(policy.draw)
            if mine is None or not policy.rollouts.keys() <= mine.rollouts.keys():
                return None
            found.append(replace(mine, rollouts={seed: mine.rollouts[seed] for seed in policy.rollouts}))
        return replace(self, policies=tuple(found))

    @property
    def content(self) -> dict[str, Any]:
        """The entry in the report's JSON."""
        return {
            "task": self.task,
            "label": self.label,
            "treatment": self.treatment,
            "draws": self.shares,
            "successes": int(self.rolled().sum()),
            "rollouts": len(self.rolled()),
            "touched": float(self.rolled("contact").mean()),
            "length": self.mean("length"),
            "failures": self.failures,
        }


@dataclass(frozen=True)
class Results:
    """All that is done of a study; its conditions by task, label and treatment."""

    progress: StudyProgress
    conditions: Mapping[tuple[str, str, str], StudyCondition]

    def find(self, task: str, label: str, treatment: str = "") -> StudyCondition | None:
        """Return a condition; None where nothing of it is done."""
        return self.conditions.get((task, label, treatment))

    def of_task(self, task: str, treated: bool = False) -> list[StudyCondition]:
        """Return the conditions of a task, disturbed and protected ones or the others."""
        return [
            each for each in self.conditions.values() if (each.task, bool(each.treatment)) == (task, treated)
        ]

    def collected(self, task: str) -> dict[str, list[dict[str, Any]]]:
        """Return what was collected, draw by draw, of each mode; of rounds each way, round by round."""
        found = {job.cell.kind: [] for job in self.progress.jobs}
        for job, note in self.progress.notes.items():
            if job.policy is None and job.cell.task == task:
                found[job.cell.kind].append(note["result"])
        return {kind: each for kind, each in found.items() if each}

    def trained(self, condition: StudyCondition) -> list[dict[str, Any]]:
        """Return what came of the trainings of a condition's policies."""
        notes = self.progress.notes.items()
        return [note["result"] for job, note in notes if job.policy in condition.learners]


def gather(progress: StudyProgress) -> Results:
    """Return what is done of a study: the main design first, in the order of its modes."""
    found: dict[tuple[str, str, str], StudyCondition] = {}
    for job in progress.jobs:
        for file in progress.rollouts(job):
            for label, condition in read_evaluations([file]).items():
                assert job.policy is not None
                treatment = label.removeprefix(job.policy.label).strip()
                key = job.cell.task, job.policy.label, treatment
                known = found.get(key) or StudyCondition(job.policy.label, (), job.cell.task, treatment, ())
                found[key] = replace(
                    known,
                    policies=(*known.policies, *condition.policies),
                    learners=(*known.learners, job.policy),
                )
    ordered = sorted(found.items(), key=lambda item: _place(item[1].learners[0]))
    return Results(progress, dict(ordered))


def _place(policy: StudyPolicy) -> tuple[bool, bool, float]:
    """Sort the main design before what is beside it; else as the jobs come."""
    return policy.budget == "number", policy.actions != "realised", policy.minutes

"""What a study found so far: what was collected, how the policies fared, under which conditions."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from handrail.datasets.comparison.collection import Collected, collected
from handrail.datasets.comparison.evaluations import Arm, read_evaluations
from handrail.datasets.comparison.findings import Finding, outcome_findings
from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.outcomes import ArmOutcome, Outcomes, judge
from handrail.datasets.quality.load import read_demonstrations
from handrail.datasets.reader import read_info
from handrail.policies.study.design import StudyDesign
from handrail.policies.study.jobs import Cell
from handrail.policies.study.standing import Standing

CONTACTS = "contacts"


@dataclass(frozen=True)
class Condition:
    """All policies of an arm under one condition.

    Attributes:
        outcome: success with its intervals.
        touched: share of rollouts with a contact.
        contacts: mean a rollout.
    """

    outcome: ArmOutcome
    touched: float
    contacts: float


@dataclass(frozen=True)
class SweepPoint:
    """An arm at one level of the operator's noise.

    Attributes:
        noise: 0 perfect, 1 as people are.
        outcome: of its policies.
        seconds: operator time of a successful demonstration, failed attempts included [s].
    """

    noise: float
    outcome: ArmOutcome
    seconds: float


@dataclass(frozen=True)
class TaskResults:
    """One task.

    Attributes:
        task: its name.
        collected: by mode.
        policies: undisturbed; None before any was evaluated.
        conditions: undisturbed, by arm.
        disturbed: by arm and what disturbs, `ee push`.
        protected: by arm and protection, `direct filter`.
        sweep: by arm, in the order of the noise.
        findings: in words.
    """

    task: str
    collected: Mapping[str, Collected]
    policies: Outcomes | None
    conditions: Mapping[str, Condition]
    disturbed: Mapping[str, Condition]
    protected: Mapping[str, Condition]
    sweep: Mapping[str, tuple[SweepPoint, ...]]
    findings: tuple[Finding, ...]


def gather(standing: Standing, rng: np.random.Generator) -> list[TaskResults]:
    """Return what is done of every task.

    Args:
        standing: of the study.
        rng: of the resampling.
    """
    return [_task(task, standing.design, standing, rng) for task in standing.design.tasks]


def _task(task: str, design: StudyDesign, standing: Standing, rng: np.random.Generator) -> TaskResults:
    cells = {mode: Cell(task, mode) for mode in design.modes}
    data = {mode: _collected(standing, cell) for mode, cell in cells.items()}
    nominal = _arms(design, standing, task, "nominal")
    base = design.baseline if design.baseline in nominal else next(iter(nominal), "")
    judged = judge(nominal, base, rng) if nominal else None
    found = tuple(outcome_findings(judged)) if judged else ()
    return TaskResults(
        task=task,
        collected={mode: each for mode, each in data.items() if each},
        policies=judged,
        conditions=_conditions(nominal, rng),
        disturbed=_conditions(_arms(design, standing, task, "disturbed"), rng),
        protected=_conditions(_arms(design, standing, task, "protected"), rng),
        sweep=_sweep(design, standing, task, rng),
        findings=found,
    )


def _collected(standing: Standing, cell: Cell) -> Collected | None:
    root = standing.dataset(cell)
    if root is None:
        return None
    return collected(Group(cell.mode, read_info(root), tuple(read_demonstrations(root))))


def _arms(
    design: StudyDesign, standing: Standing, task: str, what: str, noise: float = 1.0
) -> dict[str, Arm]:
    """Return the arms of a task under some conditions, in the order of the design's modes."""
    arms: dict[str, Arm] = {}
    for mode in design.modes:
        arms |= read_evaluations(standing.evaluations(Cell(task, mode, noise), what))
    return arms


def _conditions(arms: Mapping[str, Arm], rng: np.random.Generator) -> dict[str, Condition]:
    return {label: _condition(arm, rng) for label, arm in arms.items()}


def _condition(arm: Arm, rng: np.random.Generator) -> Condition:
    (outcome,) = judge({arm.label: arm}, arm.label, rng).arms
    contacts = np.concatenate([run.values for run in arm.runs(CONTACTS)])
    return Condition(outcome, float(np.mean(contacts > 0)), float(np.mean(contacts)))


def _sweep(
    design: StudyDesign, standing: Standing, task: str, rng: np.random.Generator
) -> dict[str, tuple[SweepPoint, ...]]:
    if not design.sweep or task not in design.sweep.tasks:
        return {}
    points: dict[str, list[SweepPoint]] = {}
    for noise in sorted({1.0, *design.sweep.noises}):
        arms = _arms(design, standing, task, "nominal", noise)
        for mode in design.modes:
            data = _collected(standing, Cell(task, mode, noise))
            mine = [arm for label, arm in arms.items() if label in (mode, f"{mode} intent")]
            if data is None or not data.successes:
                continue
            seconds = data.operator_time / data.successes
            for arm in mine:
                outcome = _condition(arm, rng).outcome
                points.setdefault(arm.label, []).append(SweepPoint(noise, outcome, seconds))
    return {label: tuple(each) for label, each in points.items()}

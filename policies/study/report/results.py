"""What a study found so far: what was collected, how the policies fared, under which treatments."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handrail.datasets.comparison.collection import Collected, collected
from handrail.datasets.comparison.evaluations import Condition, read_evaluations
from handrail.datasets.comparison.finding import Finding
from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.outcomes import ConditionOutcome, Outcomes, in_families, judge_pairs
from handrail.datasets.quality.load import read_demonstrations
from handrail.datasets.reading.reader import read_info
from handrail.policies.study.design.design import StudyDesign, Sweep
from handrail.policies.study.design.jobs import Cell
from handrail.policies.study.progress.progress import StudyProgress
from handrail.policies.study.report.conditions import StudyCondition, identify, pairs
from handrail.policies.study.report.treatments import ConditionResult, outcome, treatments
from handrail.policies.study.report.words import Judged, answer, findings


@dataclass(frozen=True)
class SweepPoint:
    """A condition at one level of the operator's noise.

    Attributes:
        condition: what it is.
        noise: 0 perfect, 1 as people are.
        outcome: of its policies of the training seeds that the sweep has.
        seconds: operator time of a successful demonstration, failed attempts included [s].
    """

    condition: StudyCondition
    noise: float
    outcome: ConditionOutcome
    seconds: float


@dataclass(frozen=True)
class TaskResults:
    """One task.

    Attributes:
        task: its name.
        collected: by mode.
        policies: undisturbed, each against the baseline of its budget; None before any was evaluated.
        shielded: joint velocities through a protection, each against the baseline's through the same one.
        undisturbed: with neither disturbance nor protection, by condition.
        disturbed: by condition and what disturbs, `ee pushed`.
        protected: by condition and protection, `direct filter`.
        sweep: by condition, in the order of the noise.
        answer: in a few sentences, what is like for like first.
        findings: in words.
    """

    task: str
    collected: Mapping[str, Collected]
    policies: Outcomes | None
    shielded: Outcomes | None
    undisturbed: Mapping[str, ConditionResult]
    disturbed: Mapping[str, ConditionResult]
    protected: Mapping[str, ConditionResult]
    sweep: Mapping[str, tuple[SweepPoint, ...]]
    answer: str = ""
    findings: tuple[Finding, ...] = ()


def gather(progress: StudyProgress, rng: np.random.Generator) -> list[TaskResults]:
    """Return what is done of every task.

    Args:
        progress: of the study.
        rng: of the resampling.
    """
    design = progress.design
    return _in_words([_task(task, design, progress, rng) for task in design.tasks], design)


def _in_words(results: Sequence[TaskResults], design: StudyDesign) -> list[TaskResults]:
    """Return results with p adjusted over all tasks, every family for itself, and what that says."""
    policies = _in_families([each.policies for each in results])
    shielded = _in_families([each.shielded for each in results])
    return [
        _told(replace(each, policies=open_, shielded=closed), design)
        for each, open_, closed in zip(results, policies, shielded, strict=True)
    ]


def _in_families(found: Sequence[Outcomes | None]) -> list[Outcomes | None]:
    """Return outcomes of all tasks with the p of their differences adjusted for all of a family."""
    adjusted = iter(in_families([each for outcomes in found if outcomes for each in outcomes.differences]))
    return [
        each and replace(each, differences=tuple(next(adjusted) for _ in each.differences)) for each in found
    ]


def _told(results: TaskResults, design: StudyDesign) -> TaskResults:
    undisturbed, shielded = (
        Judged({label: each.condition for label, each in found.items()}, outcomes)
        for found, outcomes in (
            (results.undisturbed, results.policies),
            (results.protected, results.shielded),
        )
    )
    return replace(
        results,
        answer=answer(undisturbed, shielded),
        findings=findings(undisturbed, shielded, design.baseline),
    )


def _task(task: str, design: StudyDesign, progress: StudyProgress, rng: np.random.Generator) -> TaskResults:
    cells = {mode: Cell(task, mode) for mode in design.modes}
    data = {mode: _collected(progress, cell) for mode, cell in cells.items()}
    nominal = _conditions(design, progress, task, "nominal")
    disturbed = _conditions(design, progress, task, "disturbed")
    protected = _conditions(design, progress, task, "protected")
    kinds = [identify(design, list(conditions)) for conditions in (nominal, disturbed, protected)]
    return TaskResults(
        task=task,
        collected={mode: each for mode, each in data.items() if each},
        policies=_judged(nominal, kinds[0], design.baseline, rng),
        shielded=_judged(protected, kinds[2], design.baseline, rng),
        undisturbed=treatments(kinds[0], nominal, nominal, rng),
        disturbed=treatments(kinds[1], disturbed, nominal, rng),
        protected=treatments(kinds[2], protected, nominal, rng),
        sweep=_sweep(design, progress, task, rng),
    )


def _judged(
    conditions: Mapping[str, Condition],
    kinds: Mapping[str, StudyCondition],
    baseline: str,
    rng: np.random.Generator,
) -> Outcomes | None:
    ordered = {label: conditions[label] for label in kinds}
    return judge_pairs(ordered, pairs(kinds, baseline), rng) if conditions else None


def _collected(progress: StudyProgress, cell: Cell) -> Collected | None:
    root = progress.dataset(cell)
    if root is None:
        return None
    return collected(Group(cell.mode, read_info(root), tuple(read_demonstrations(root))))


def _conditions(
    design: StudyDesign, progress: StudyProgress, task: str, what: str, noise: float = 1.0
) -> dict[str, Condition]:
    """Return the conditions of a task under some treatments, in the order of the design's modes."""
    conditions: dict[str, Condition] = {}
    for mode in design.modes:
        conditions |= read_evaluations(progress.evaluations(Cell(task, mode, noise), what))
    return conditions


def _sweep(
    design: StudyDesign, progress: StudyProgress, task: str, rng: np.random.Generator
) -> dict[str, tuple[SweepPoint, ...]]:
    if not design.sweep or task not in design.sweep.tasks:
        return {}
    points: dict[str, list[SweepPoint]] = {}
    for noise in sorted({1.0, *design.sweep.noises}):
        conditions = _conditions(design, progress, task, "nominal", noise)
        data = {mode: _collected(progress, Cell(task, mode, noise)) for mode in design.modes}
        for label, kind in identify(design, list(conditions)).items():
            found, condition = data[kind.mode], _of_sweep(conditions[label], design.sweep)
            if kind.budget == design.budgets[0] and found and found.successes and condition:
                seconds = found.operator_time / found.successes
                points.setdefault(label, []).append(SweepPoint(kind, noise, outcome(condition, rng), seconds))
    return {label: tuple(each) for label, each in points.items()}


def _of_sweep(condition: Condition, sweep: Sweep) -> Condition | None:
    """Return the policies of the training seeds that every level of the noise has."""
    return condition.only({key for key in condition.rollouts if key[1] in sweep.seeds})

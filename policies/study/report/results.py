"""What a study found so far: what was collected, how the policies fared, under which conditions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handrail.datasets.comparison.collection import Collected, collected
from handrail.datasets.comparison.evaluations import Arm, read_evaluations
from handrail.datasets.comparison.finding import Finding
from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.outcomes import ArmOutcome, Outcomes, in_families, judge_pairs
from handrail.datasets.quality.load import read_demonstrations
from handrail.datasets.reading.reader import read_info
from handrail.policies.study.design.design import StudyDesign, Sweep
from handrail.policies.study.design.jobs import Cell
from handrail.policies.study.progress.progress import Standing
from handrail.policies.study.report.arms import StudyArm, identify, pairs
from handrail.policies.study.report.conditions import Condition, conditions, outcome
from handrail.policies.study.report.words import Judged, answer, findings


@dataclass(frozen=True)
class SweepPoint:
    """An arm at one level of the operator's noise.

    Attributes:
        arm: what it is.
        noise: 0 perfect, 1 as people are.
        outcome: of its policies of the training seeds that the sweep has.
        seconds: operator time of a successful demonstration, failed attempts included [s].
    """

    arm: StudyArm
    noise: float
    outcome: ArmOutcome
    seconds: float


@dataclass(frozen=True)
class TaskResults:
    """One task.

    Attributes:
        task: its name.
        collected: by mode.
        policies: undisturbed, each against the baseline of its budget; None before any was evaluated.
        shielded: joint velocities through a protection, each against the baseline's through the same one.
        conditions: undisturbed, by arm.
        disturbed: by arm and what disturbs, `ee pushed`.
        protected: by arm and protection, `direct filter`.
        sweep: by arm, in the order of the noise.
        answer: in a few sentences, what is like for like first.
        findings: in words.
    """

    task: str
    collected: Mapping[str, Collected]
    policies: Outcomes | None
    shielded: Outcomes | None
    conditions: Mapping[str, Condition]
    disturbed: Mapping[str, Condition]
    protected: Mapping[str, Condition]
    sweep: Mapping[str, tuple[SweepPoint, ...]]
    answer: str = ""
    findings: tuple[Finding, ...] = ()


def gather(standing: Standing, rng: np.random.Generator) -> list[TaskResults]:
    """Return what is done of every task.

    Args:
        standing: of the study.
        rng: of the resampling.
    """
    design = standing.design
    return _in_words([_task(task, design, standing, rng) for task in design.tasks], design)


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
        Judged({label: each.arm for label, each in found.items()}, outcomes)
        for found, outcomes in (
            (results.conditions, results.policies),
            (results.protected, results.shielded),
        )
    )
    return replace(
        results,
        answer=answer(undisturbed, shielded),
        findings=findings(undisturbed, shielded, design.baseline),
    )


def _task(task: str, design: StudyDesign, standing: Standing, rng: np.random.Generator) -> TaskResults:
    cells = {mode: Cell(task, mode) for mode in design.modes}
    data = {mode: _collected(standing, cell) for mode, cell in cells.items()}
    nominal = _arms(design, standing, task, "nominal")
    disturbed = _arms(design, standing, task, "disturbed")
    protected = _arms(design, standing, task, "protected")
    kinds = [identify(design, list(arms)) for arms in (nominal, disturbed, protected)]
    return TaskResults(
        task=task,
        collected={mode: each for mode, each in data.items() if each},
        policies=_judged(nominal, kinds[0], design.baseline, rng),
        shielded=_judged(protected, kinds[2], design.baseline, rng),
        conditions=conditions(kinds[0], nominal, nominal, rng),
        disturbed=conditions(kinds[1], disturbed, nominal, rng),
        protected=conditions(kinds[2], protected, nominal, rng),
        sweep=_sweep(design, standing, task, rng),
    )


def _judged(
    arms: Mapping[str, Arm], kinds: Mapping[str, StudyArm], baseline: str, rng: np.random.Generator
) -> Outcomes | None:
    ordered = {label: arms[label] for label in kinds}
    return judge_pairs(ordered, pairs(kinds, baseline), rng) if arms else None


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


def _sweep(
    design: StudyDesign, standing: Standing, task: str, rng: np.random.Generator
) -> dict[str, tuple[SweepPoint, ...]]:
    if not design.sweep or task not in design.sweep.tasks:
        return {}
    points: dict[str, list[SweepPoint]] = {}
    for noise in sorted({1.0, *design.sweep.noises}):
        arms = _arms(design, standing, task, "nominal", noise)
        data = {mode: _collected(standing, Cell(task, mode, noise)) for mode in design.modes}
        for label, kind in identify(design, list(arms)).items():
            found, arm = data[kind.mode], _of_sweep(arms[label], design.sweep)
            if kind.budget == design.budgets[0] and found and found.successes and arm:
                seconds = found.operator_time / found.successes
                points.setdefault(label, []).append(SweepPoint(kind, noise, outcome(arm, rng), seconds))
    return {label: tuple(each) for label, each in points.items()}


def _of_sweep(arm: Arm, sweep: Sweep) -> Arm | None:
    """Return the policies of the training seeds that every level of the noise has."""
    return arm.only({key for key in arm.rollouts if key[1] in sweep.seeds})

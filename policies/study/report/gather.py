"""Gathers what of a study is done, task by task, and says it in words."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from handrail.datasets.comparison.collection import Collected, collected
from handrail.datasets.comparison.evaluations import Condition, read_evaluations
from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.outcomes import (
    ConditionOutcome,
    Outcomes,
    compare_rollouts,
    in_families,
    judge,
    judge_pairs,
)
from handrail.datasets.quality.load import recorded_episodes
from handrail.datasets.reading.reader import read_info
from handrail.policies.study.design.design import StudyDesign, Sweep
from handrail.policies.study.design.jobs import Cell
from handrail.policies.study.design.progress import StudyProgress
from handrail.policies.study.report.conditions import StudyCondition, identify, pairs
from handrail.policies.study.report.results import ConditionResult, SweepPoint, TaskResults
from handrail.policies.study.report.words import answer, findings


def gather(progress: StudyProgress, rng: np.random.Generator) -> list[TaskResults]:
    """Return what is done of every task.

    Args:
        progress: of the study.
        rng: of the resampling.
    """
    design = progress.design
    return in_words([task_results(task, design, progress, rng) for task in design.tasks], design)


def in_words(results: Sequence[TaskResults], design: StudyDesign) -> list[TaskResults]:
    """Return results with p adjusted over all tasks, every family for itself, and what that says."""
    found = [outcomes for each in results for outcomes in (each.policies, each.shielded)]
    adjusted = iter(in_families([each for outcomes in found if outcomes for each in outcomes.differences]))
    told = iter(
        [
            each and replace(each, differences=tuple(next(adjusted) for _ in each.differences))
            for each in found
        ]
    )
    judged = [replace(each, policies=next(told), shielded=next(told)) for each in results]
    return [replace(each, answer=answer(each), findings=findings(each, design.baseline)) for each in judged]


def task_results(
    task: str, design: StudyDesign, progress: StudyProgress, rng: np.random.Generator
) -> TaskResults:
    """Return what came of a task, p not adjusted yet."""
    cells = {mode: Cell(task, mode) for mode in design.modes}
    data = {mode: read_collected(progress, cell) for mode, cell in cells.items()}
    nominal = read_conditions(design, progress, task, "nominal")
    disturbed = read_conditions(design, progress, task, "disturbed")
    protected = read_conditions(design, progress, task, "protected")
    kinds = [identify(design, list(conditions)) for conditions in (nominal, disturbed, protected)]
    return TaskResults(
        task=task,
        collected={mode: each for mode, each in data.items() if each},
        policies=_judged(nominal, kinds[0], design.baseline, rng),
        shielded=_judged(protected, kinds[2], design.baseline, rng),
        undisturbed=_treatments(kinds[0], nominal, nominal, rng),
        disturbed=_treatments(kinds[1], disturbed, nominal, rng),
        protected=_treatments(kinds[2], protected, nominal, rng),
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


def read_collected(progress: StudyProgress, cell: Cell) -> Collected | None:
    """Return what was collected in a cell; None where there is no dataset."""
    root = progress.dataset(cell)
    if root is None:
        return None
    return collected(Group(cell.mode, read_info(root), tuple(recorded_episodes(root))))


def read_conditions(
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
        conditions = read_conditions(design, progress, task, "nominal", noise)
        data = {mode: read_collected(progress, Cell(task, mode, noise)) for mode in design.modes}
        for label, kind in identify(design, list(conditions)).items():
            found, condition = data[kind.mode], _of_sweep(conditions[label], design.sweep)
            if kind.budget == design.budgets[0] and found and found.successes and condition:
                seconds = found.operator_time / found.successes
                points.setdefault(label, []).append(
                    SweepPoint(kind, noise, _outcome(condition, rng), seconds)
                )
    return {label: tuple(each) for label, each in points.items()}


def _of_sweep(condition: Condition, sweep: Sweep) -> Condition | None:
    """Return the policies of the training seeds that every level of the noise has."""
    return condition.only({key for key in condition.rollouts if key[1] in sweep.seeds})


def _treatments(
    kinds: Mapping[str, StudyCondition],
    conditions: Mapping[str, Condition],
    undisturbed: Mapping[str, Condition],
    rng: np.random.Generator,
) -> dict[str, ConditionResult]:
    """Return every condition beside the same policies in the same scenes without its treatment."""
    return {label: _treatment(kind, conditions[label], undisturbed, rng) for label, kind in kinds.items()}


def _treatment(
    kind: StudyCondition, condition: Condition, undisturbed: Mapping[str, Condition], rng: np.random.Generator
) -> ConditionResult:
    contacts = np.concatenate([run.values for run in condition.runs("contacts")])
    found = ConditionResult(
        kind, _outcome(condition, rng), float(np.mean(contacts > 0)), float(np.mean(contacts))
    )
    whole = undisturbed.get(kind.label) if kind.treatment else None
    same = whole.only(condition.rollouts) if whole else None
    if same is None or same.rollouts != condition.rollouts:
        return found
    return replace(found, without=_outcome(same, rng), change=compare_rollouts(condition.runs(), same.runs()))


def _outcome(condition: Condition, rng: np.random.Generator) -> ConditionOutcome:
    """Return how a condition fared, for itself."""
    (found,) = judge({condition.label: condition}, condition.label, rng).conditions
    return found

"""What a task's policies say: like for like first, then policies with a controller, then cautions."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from handrail.datasets.comparison.cautions import training_cautions
from handrail.datasets.comparison.finding import Finding
from handrail.datasets.comparison.outcome_findings import outcome_findings
from handrail.datasets.comparison.outcomes import Outcomes
from handrail.policies.study.report.conditions import FAMILIES, StudyCondition
from handrail.policies.study.report.results import ConditionResult, TaskResults

_UNPROTECTED = "Like for like, joint velocities, unprotected"
_PROTECTED = "Like for like, joint velocities, both through the"
_CONTROLLER = "Policy plus controller, intent through the MPC against joint velocities, unprotected"


def findings(results: TaskResults, baseline: str) -> tuple[Finding, ...]:
    """Return all findings of a task; each says first what is compared with what."""
    found = [replace(finding, text=f"{title}: {finding.text}") for title, finding in _titled(results)]
    cautions = list(_missing(results, baseline))
    for outcomes, conditions in _judged(results):
        cautions += _cautions(outcomes, conditions)
    return (*found, *(Finding("caution", text) for text in dict.fromkeys(cautions)))


def answer(results: TaskResults) -> str:
    """Return the answer in a few sentences, one for each kind of comparison."""
    parts: dict[str, list[str]] = {}
    for title, finding in _titled(results):
        parts.setdefault(title, []).append(finding.short)
    return " ".join(f"{title}: {'; '.join(shorts)}." for title, shorts in parts.items())


def _judged(results: TaskResults) -> Iterator[tuple[Outcomes, Mapping[str, ConditionResult]]]:
    """Yield the outcomes there are, undisturbed and protected, and what their conditions are."""
    for outcomes, conditions in (
        (results.policies, results.undisturbed),
        (results.shielded, results.protected),
    ):
        if outcomes:
            yield outcomes, conditions


def _titled(results: TaskResults) -> list[tuple[str, Finding]]:
    """Return findings with what they compare: joint velocities, these through a protection, then intents."""
    found = [pair for judged in _judged(results) for pair in _of(*judged)]
    found.sort(key=lambda pair: FAMILIES.index(pair[0].family))
    return [(_title(condition), finding) for condition, finding in found]


def _title(condition: StudyCondition) -> str:
    if condition.actions == "intent":
        return _CONTROLLER
    return f"{_PROTECTED} {condition.treatment}" if condition.treatment else _UNPROTECTED


def _of(
    outcomes: Outcomes, conditions: Mapping[str, ConditionResult]
) -> Iterator[tuple[StudyCondition, Finding]]:
    """Yield what every difference says, conditions called after their data alone: the title says the rest."""
    by_label = {condition.label: condition for condition in outcomes.conditions}
    for difference in outcomes.differences:
        labels = [difference.label, difference.baseline]
        names = [conditions[label].condition.label for label in labels]
        both = tuple(replace(by_label[label], label=name) for label, name in zip(labels, names, strict=True))
        named = replace(difference, label=names[0], baseline=names[1])
        (finding,) = outcome_findings(Outcomes(both, (named,)))
        yield conditions[difference.label].condition, finding


def _missing(results: TaskResults, baseline: str) -> Iterator[str]:
    differences = results.policies.differences if results.policies else ()
    compared = {each.label for each in differences}
    alone = [
        label
        for label, each in results.undisturbed.items()
        if label not in compared and (each.condition.mode, each.condition.actions) != (baseline, "realised")
    ]
    if alone:
        yield (
            f"Compared with nothing: {', '.join(alone)}; there is no policy yet of joint velocities that"
            f" learnt from {baseline} on the same budget."
        )


def _cautions(outcomes: Outcomes, conditions: Mapping[str, ConditionResult]) -> Iterator[str]:
    """Yield what the intervals leave out; budgets differ on purpose, so each for itself."""
    for budget in dict.fromkeys(each.condition.budget for each in conditions.values()):
        mine = {label for label, each in conditions.items() if each.condition.budget == budget}
        differences = tuple(each for each in outcomes.differences if each.label in mine)
        if differences:
            of_budget = tuple(condition for condition in outcomes.conditions if condition.label in mine)
            yield from training_cautions(Outcomes(of_budget, differences))

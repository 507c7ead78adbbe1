"""What a task's policies say: like for like first, then policies with a controller, then cautions."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from handrail.datasets.comparison.cautions import training_cautions
from handrail.datasets.comparison.finding import Finding
from handrail.datasets.comparison.outcome_findings import outcome_findings
from handrail.datasets.comparison.outcomes import OutcomeDifference, Outcomes
from handrail.policies.study.report.conditions import StudyCondition

_UNPROTECTED = "Like for like, joint velocities, unprotected"
_PROTECTED = "Like for like, joint velocities, both through the"
_CONTROLLER = "Policy plus controller, intent through the MPC against joint velocities, unprotected"


@dataclass(frozen=True)
class Judged:
    """Conditions under treatments of one kind, and each against its baseline.

    Attributes:
        conditions: what they are, by label.
        outcomes: how they fared; None before any was evaluated.
    """

    conditions: Mapping[str, StudyCondition]
    outcomes: Outcomes | None


def findings(undisturbed: Judged, shielded: Judged, baseline: str) -> tuple[Finding, ...]:
    """Return all findings of a task; each says first what is compared with what."""
    found = [
        replace(finding, text=f"{title}: {finding.text}") for title, finding in _titled(undisturbed, shielded)
    ]
    cautions = [*_missing(undisturbed, baseline), *_cautions(undisturbed), *_cautions(shielded)]
    return (*found, *(Finding("caution", text) for text in dict.fromkeys(cautions)))


def answer(undisturbed: Judged, shielded: Judged) -> str:
    """Return the answer in a few sentences, one for each kind of comparison."""
    parts: dict[str, list[str]] = {}
    for title, finding in _titled(undisturbed, shielded):
        parts.setdefault(title, []).append(finding.short)
    return " ".join(f"{title}: {'; '.join(shorts)}." for title, shorts in parts.items())


def _titled(undisturbed: Judged, shielded: Judged) -> Iterator[tuple[str, Finding]]:
    """Yield findings with what they compare: joint velocities, these through a protection, then intents."""
    found = [*_of(undisturbed), *_of(shielded)]
    for wanted in (
        _alike,
        lambda condition: bool(condition.treatment),
        lambda condition: condition.actions == "intent",
    ):
        for condition, finding in found:
            if wanted(condition):
                yield _title(condition), finding


def _alike(condition: StudyCondition) -> bool:
    return condition.actions == "realised" and not condition.treatment


def _title(condition: StudyCondition) -> str:
    if condition.actions == "intent":
        return _CONTROLLER
    return f"{_PROTECTED} {condition.treatment}" if condition.treatment else _UNPROTECTED


def _of(judged: Judged) -> Iterator[tuple[StudyCondition, Finding]]:
    """Yield what every difference says, conditions called after their data alone: the title says the rest."""
    if judged.outcomes is None:
        return
    by_label = {condition.label: condition for condition in judged.outcomes.conditions}
    for difference in judged.outcomes.differences:
        labels = [difference.label, difference.baseline]
        names = [judged.conditions[label].label for label in labels]
        both = tuple(replace(by_label[label], label=name) for label, name in zip(labels, names, strict=True))
        named = replace(difference, label=names[0], baseline=names[1])
        (finding,) = outcome_findings(Outcomes(both, (named,)))
        yield judged.conditions[difference.label], finding


def _missing(judged: Judged, baseline: str) -> Iterator[str]:
    differences = judged.outcomes.differences if judged.outcomes else ()
    compared = {each.label for each in differences}
    alone = [
        label
        for label, condition in judged.conditions.items()
        if label not in compared and (condition.mode, condition.actions) != (baseline, "realised")
    ]
    if alone:
        yield (
            f"Compared with nothing: {', '.join(alone)}; there is no policy yet of joint velocities that"
            f" learnt from {baseline} on the same budget."
        )


def _cautions(judged: Judged) -> Iterator[str]:
    """Yield what the intervals leave out; budgets differ on purpose, so each for itself."""
    found = judged.outcomes
    for budget in dict.fromkeys(condition.budget for condition in judged.conditions.values()):
        mine = {label for label, condition in judged.conditions.items() if condition.budget == budget}
        if found and any(each.label in mine for each in found.differences):
            conditions = tuple(condition for condition in found.conditions if condition.label in mine)
            yield from training_cautions(Outcomes(conditions, _only(found.differences, mine)))


def _only(differences: Sequence[OutcomeDifference], labels: set[str]) -> tuple[OutcomeDifference, ...]:
    return tuple(each for each in differences if each.label in labels)

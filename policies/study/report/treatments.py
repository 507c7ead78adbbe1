"""Policies disturbed and protected, each beside the same policies in the same scenes without that."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from handrail.datasets.comparison.evaluations import Condition
from handrail.datasets.comparison.outcomes import ConditionOutcome, compare_rollouts, judge
from handrail.datasets.statistics.proportions import ShareDifference
from handrail.policies.study.report.conditions import StudyCondition

CONTACTS = "contacts"


@dataclass(frozen=True)
class ConditionResult:
    """All policies of a condition under one treatment.

    Attributes:
        condition: what it is.
        outcome: success with its intervals.
        touched: share of rollouts with a contact.
        contacts: mean a rollout.
        without: outcome of the same policies in the same scenes with neither disturbance nor protection; None
            where this is it, or it is not known.
        change: success minus that, as pairs.
    """

    condition: StudyCondition
    outcome: ConditionOutcome
    touched: float
    contacts: float
    without: ConditionOutcome | None = None
    change: ShareDifference | None = None


def treatments(
    kinds: Mapping[str, StudyCondition],
    conditions: Mapping[str, Condition],
    undisturbed: Mapping[str, Condition],
    rng: np.random.Generator,
) -> dict[str, ConditionResult]:
    """Return every condition under its treatment.

    Args:
        kinds: what the conditions are, by label, in the order to be shown.
        conditions: what they did.
        undisturbed: what policies did with neither disturbance nor protection, by label.
        rng: of the resampling.
    """
    return {label: _treatment(kind, conditions[label], undisturbed, rng) for label, kind in kinds.items()}


def _treatment(
    kind: StudyCondition, condition: Condition, undisturbed: Mapping[str, Condition], rng: np.random.Generator
) -> ConditionResult:
    contacts = np.concatenate([run.values for run in condition.runs(CONTACTS)])
    found = ConditionResult(
        kind, outcome(condition, rng), float(np.mean(contacts > 0)), float(np.mean(contacts))
    )
    whole = undisturbed.get(kind.label) if kind.treatment else None
    same = whole.only(condition.rollouts) if whole else None
    if same is None or same.rollouts != condition.rollouts:
        return found
    return replace(found, without=outcome(same, rng), change=compare_rollouts(condition.runs(), same.runs()))


def outcome(condition: Condition, rng: np.random.Generator) -> ConditionOutcome:
    """Return how a condition fared, for itself."""
    (found,) = judge({condition.label: condition}, condition.label, rng).conditions
    return found

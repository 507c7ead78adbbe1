"""Policies disturbed and protected, each beside the same policies in the same scenes without that."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from handrail.datasets.comparison.evaluations import Arm
from handrail.datasets.comparison.outcomes import ArmOutcome, compare_rollouts, judge
from handrail.datasets.statistics.proportions import ShareDifference
from handrail.policies.study.report.arms import StudyArm

CONTACTS = "contacts"


@dataclass(frozen=True)
class Condition:
    """All policies of an arm under one condition.

    Attributes:
        arm: what it is.
        outcome: success with its intervals.
        touched: share of rollouts with a contact.
        contacts: mean a rollout.
        without: outcome of the same policies in the same scenes with neither disturbance nor protection; None
            where this is it, or it is not known.
        change: success minus that, as pairs.
    """

    arm: StudyArm
    outcome: ArmOutcome
    touched: float
    contacts: float
    without: ArmOutcome | None = None
    change: ShareDifference | None = None


def conditions(
    kinds: Mapping[str, StudyArm],
    arms: Mapping[str, Arm],
    undisturbed: Mapping[str, Arm],
    rng: np.random.Generator,
) -> dict[str, Condition]:
    """Return every arm under its condition.

    Args:
        kinds: what the arms are, by label, in the order to be shown.
        arms: what they did.
        undisturbed: what policies did with neither disturbance nor protection, by label.
        rng: of the resampling.
    """
    return {label: _condition(kind, arms[label], undisturbed, rng) for label, kind in kinds.items()}


def _condition(
    kind: StudyArm, arm: Arm, undisturbed: Mapping[str, Arm], rng: np.random.Generator
) -> Condition:
    contacts = np.concatenate([run.values for run in arm.runs(CONTACTS)])
    found = Condition(kind, outcome(arm, rng), float(np.mean(contacts > 0)), float(np.mean(contacts)))
    whole = undisturbed.get(kind.label) if kind.condition else None
    same = whole.only(arm.rollouts) if whole else None
    if same is None or same.rollouts != arm.rollouts:
        return found
    return replace(found, without=outcome(same, rng), change=compare_rollouts(arm.runs(), same.runs()))


def outcome(arm: Arm, rng: np.random.Generator) -> ArmOutcome:
    """Return how an arm fared, for itself."""
    (found,) = judge({arm.label: arm}, arm.label, rng).arms
    return found

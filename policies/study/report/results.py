"""What a study found so far: what was collected, how the policies fared, under which treatments."""

from collections.abc import Mapping
from dataclasses import dataclass

from handrail.datasets.comparison.collection import Collected
from handrail.datasets.comparison.finding import Finding
from handrail.datasets.comparison.outcomes import ConditionOutcome, Outcomes
from handrail.datasets.statistics.proportions import ShareDifference
from handrail.policies.study.report.conditions import StudyCondition


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

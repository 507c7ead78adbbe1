"""What the success of trained policies says; the larger share comes first, in headline and finding alike."""

from collections.abc import Iterator

from handrail.datasets.comparison.finding import Finding
from handrail.datasets.comparison.outcomes import ConditionOutcome, OutcomeDifference, Outcomes
from handrail.datasets.presentation.wording import counted, p_value, percent, percent_span, points_span


def outcome_findings(outcomes: Outcomes) -> Iterator[Finding]:
    """Return what the policies' success says: differences, then conditions that are compared with none."""
    conditions = {condition.label: condition for condition in outcomes.conditions}
    for difference in outcomes.differences:
        one, other = conditions[difference.label], conditions[difference.baseline]
        more, less = (one, other) if one.share >= other.share else (other, one)
        short = _short(difference, more, less)
        yield Finding("outcome", f"{short}; {_rest(difference)}", difference.detected, short)
    compared = {label for each in outcomes.differences for label in (each.label, each.baseline)}
    yield from (_alone(condition) for condition in outcomes.conditions if condition.label not in compared)


def _alone(condition: ConditionOutcome) -> Finding:
    who = "Policies" if condition.nested else "The policy"
    short = (
        f"{who} trained on {condition.label} succeeded in {percent(condition.share)}"
        f" of {condition.rollouts} rollouts (95 % {percent_span(condition.nested or condition.wilson)})"
    )
    return Finding("outcome", f"{short}; compared with no other.", short=short)


def _short(difference: OutcomeDifference, more: ConditionOutcome, less: ConditionOutcome) -> str:
    low, high = difference.nested or difference.rollouts.interval
    interval = (low, high) if difference.label == more.label else (-high, -low)
    shares = f"{more.label} {percent(more.share)}, {less.label} {percent(less.share)}"
    shares += f", difference {points_span(interval)} points"
    if not difference.detected:
        return f"Policies: no difference in success detected ({shares})"
    whose = "Policies trained on" if difference.nested else "The policy trained on"
    word = "more often" if difference.nested else "more often in one training run"
    return f"{whose} {more.label} succeeded {word} ({shares})"


def _rest(difference: OutcomeDifference) -> str:
    """Say how probable such a difference is by chance; an interval alone knows nothing of the others."""
    tests = counted(difference.tests, difference.family)
    chance = f"95 %, {p_value(difference.p_adjusted)} after Holm over {tests}"
    if difference.detected:
        return f"{chance}."
    return (
        f"{chance}. This does not show that they are equal: a difference below about"
        f" {100 * difference.detectable:.0f} points would often go unseen here."
    )

"""What the success of trained policies says; the larger share comes first, in headline and finding alike."""

from collections.abc import Iterator

from handrail.datasets.comparison.finding import Finding
from handrail.datasets.comparison.outcomes import ArmOutcome, OutcomeDifference, Outcomes
from handrail.datasets.presentation.wording import counted, p_value, percent, percent_span, points_span
from handrail.datasets.statistics.resampling import Interval


def outcome_findings(outcomes: Outcomes) -> Iterator[Finding]:
    """Return what the policies' success says: differences, then arms that are compared with none."""
    arms = {arm.label: arm for arm in outcomes.arms}
    for difference in outcomes.differences:
        one, other = arms[difference.label], arms[difference.baseline]
        more, less = (one, other) if one.share >= other.share else (other, one)
        interval = _toward(more, difference)
        text, short = _text(difference, more, less, interval), _short(difference, more, less, interval)
        yield Finding("outcome", text, difference.detected, short)
    compared = {label for each in outcomes.differences for label in (each.label, each.baseline)}
    yield from (_alone(arm) for arm in outcomes.arms if arm.label not in compared)


def _toward(more: ArmOutcome, difference: OutcomeDifference) -> Interval:
    """Return the interval of the larger share minus the smaller."""
    low, high = difference.nested or difference.rollouts.interval
    return (low, high) if difference.label == more.label else (-high, -low)


def _alone(arm: ArmOutcome) -> Finding:
    who = "Policies" if arm.nested else "The policy"
    short = (
        f"{who} trained on {arm.label} succeeded in {percent(arm.share)} of {arm.rollouts} rollouts"
        f" (95 % {percent_span(arm.nested or arm.wilson)})"
    )
    return Finding("outcome", f"{short}; compared with no other.", short=short)


def _short(difference: OutcomeDifference, more: ArmOutcome, less: ArmOutcome, interval: Interval) -> str:
    shares = f"{more.label} {percent(more.share)}, {less.label} {percent(less.share)}"
    shares += f", difference {points_span(interval)} points"
    if not difference.detected:
        return f"Policies: no difference in success detected ({shares})"
    whose = "Policies trained on" if difference.nested else "The policy trained on"
    word = "more often" if difference.nested else "more often in one training run"
    return f"{whose} {more.label} succeeded {word} ({shares})"


def _text(difference: OutcomeDifference, more: ArmOutcome, less: ArmOutcome, interval: Interval) -> str:
    shares = f"{percent(more.share)} against {percent(less.share)}"
    told = f"difference {points_span(interval)} points (95 %; {_chance(difference)})"
    if not difference.detected:
        return (
            f"No difference in policy success was detected between {more.label} and {less.label}: {shares},"
            f" {told}. This does not show that they are equal: a difference below about"
            f" {100 * difference.detectable:.0f} points would often go unseen here."
        )
    if difference.nested:
        return (
            f"Policies trained on {more.label} succeeded more often than those trained on {less.label}:"
            f" {shares}, {told}."
        )
    return (
        f"The policy trained on {more.label} succeeded more often in one training run than that trained on"
        f" {less.label}: {shares}, {told}."
    )


def _chance(difference: OutcomeDifference) -> str:
    """Say how probable such a difference is by chance; an interval alone knows nothing of the others."""
    return f"{p_value(difference.p_adjusted)} after Holm over {counted(difference.tests, difference.family)}"

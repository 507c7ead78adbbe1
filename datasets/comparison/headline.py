"""The answer of a comparison in a sentence or two; it never claims more than the intervals."""

from collections.abc import Iterator
from itertools import islice

from handrail.datasets.comparison.collection import adjusted, detected
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.outcomes import ConditionOutcome, Outcomes
from handrail.datasets.presentation.wording import number, percent, percent_span, points_span, span

_UNLIKE = "The {} differ: what follows describes each group and ranks nothing."
_UNKNOWN = "Whether episodes succeeded was not recorded for all of them."
_MOST = 3  # differences that are named; the tables have all


def headline(comparison: Comparison) -> str:
    """Return the answer: of the policies if they were evaluated, else of what was collected."""
    if comparison.unlike:
        return _UNLIKE.format(" and the ".join(comparison.unlike))
    outcomes = comparison.outcomes
    said = _of_policies(outcomes) if outcomes else _of_collecting(comparison)
    return " ".join(islice(dict.fromkeys(said), _MOST))


def _of_policies(outcomes: Outcomes) -> Iterator[str]:
    shares = {each.label: f"{each.label} {percent(each.share)}" for each in outcomes.conditions}
    for each in outcomes.differences:
        what = "Success of policies" if each.nested else "Success of one training run"
        gap = f"difference {points_span(each.nested or each.rollouts.interval)} points"
        yield _told(what, shares[each.label], shares[each.baseline], gap, each.detected)
    if not outcomes.differences:
        yield from map(_alone, outcomes.conditions)


def _alone(condition: ConditionOutcome) -> str:
    share, interval = percent(condition.share), percent_span(condition.nested or condition.wilson)
    return f"Success of policies: {condition.label} {share} (95 % {interval}), compared with no other."


def _of_collecting(comparison: Comparison) -> Iterator[str]:
    collected, base = comparison.everything.collected, comparison.baseline
    shares = {each.label: f"{each.label} {percent(each.success)}" for each in collected}
    hourly = {each.label: f"{each.label} {number(each.successes_an_hour)}" for each in collected}
    successes, rates = adjusted(comparison.success), adjusted(comparison.ratios)
    for label, success in comparison.success.items():
        if success is None:
            yield _UNKNOWN
            continue
        gap = f"difference {points_span(success.interval)} points"
        seen = detected(success.interval, successes[label])
        yield _told("Success while collecting", shares[label], shares[base], gap, seen)
        if ratio := comparison.ratios[label]:
            gap, seen = f"ratio {span(ratio.interval)}", detected(ratio.interval, rates[label], 1.0)
            yield _told("Successes an operator hour", hourly[label], hourly[base], gap, seen)


def _told(what: str, one: str, other: str, gap: str, seen: bool) -> str:
    return f"{what}: {one}, {other}; {gap} (95 %), {'a' if seen else 'no'} difference detected."

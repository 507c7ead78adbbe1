"""The answer of a comparison in a sentence or two, never more than the intervals; and what limits it."""

from collections.abc import Iterator, Sequence
from itertools import islice

from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.policies import ConditionOutcome, Outcomes
from handrail.datasets.presentation.wording import number, percent, percent_span, points_span, span

_UNLIKE = "The {} differ: what follows describes each group and ranks nothing."
_UNKNOWN = "Whether episodes succeeded was not recorded for all of them."
_NO_POLICIES = (
    "No evaluations were given: nothing here says from which data policies learn more. Quality metrics"
    " describe data and have often misjudged that."
)
_RATES = "Frame rates differ: smoothness and idle time are only roughly comparable."
_UNITS = "Some metrics are not compared, because their units may differ: the report has a table of them."
_FEW = "A group has fewer than 20 episodes: intervals of means are rough."
_FEW_SEEDS = "Fewer than 3 training seeds of a condition: the seed alone moves success by 10 to 15 points."
_SOME_SEEDS = "Three or four training seeds say little of all trainings: only large differences are detected."
_ONE_DRAW = "One draw of each dataset: how much another recording would differ is not in the intervals."
_NO_PAIRS = "Training or evaluation seeds differ between conditions: rollouts were not compared as pairs."
_NUMBERS = "The policies were trained on different numbers of episodes, which alone can make them differ."
_TIMES = "The policies were trained on different operator times, which alone can make them differ."
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
        gap = f"difference {points_span(each.nested or each.interval)} points"
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
    for label, success in comparison.success.items():
        ratio = comparison.ratios[label]
        if success.reason:
            yield _UNKNOWN
            continue
        gap = f"difference {points_span(success.interval)} points"
        yield _told("Success while collecting", shares[label], shares[base], gap, success.detected)
        if not ratio.reason:
            gap = f"ratio {span(ratio.interval)}"
            yield _told("Successes an operator hour", hourly[label], hourly[base], gap, ratio.detected)


def _told(what: str, one: str, other: str, gap: str, seen: bool) -> str:
    return f"{what}: {one}, {other}; {gap} (95 %), {'a' if seen else 'no'} difference detected."


def cautions(comparison: Comparison) -> list[str]:
    """Return what a reader has to know beside the headline."""
    groups, differences = comparison.everything.groups, comparison.everything.differences
    moving = [each for each in differences if each.measure.needs in ("motion", "position")]
    rates = len({group.info.fps for group in groups}) > 1
    known = {
        _NO_POLICIES: comparison.outcomes is None,
        **(_of_training(comparison.outcomes) if comparison.outcomes else {}),
        _RATES: rates and any(each.tested for each in moving),
        _UNITS: any(each.incomparable for each in differences),
        _FEW: min(len(group.episodes) for group in groups) < 20,
    }
    return [text for text, holds in known.items() if holds]


def _of_training(outcomes: Outcomes) -> dict[str, bool]:
    """Return what the policies' intervals and tests leave out, and whether it holds."""
    seeds = min(len(each.seeds) for each in outcomes.conditions)
    return {
        _FEW_SEEDS: seeds < 3,
        _SOME_SEEDS: 3 <= seeds < 5,
        _ONE_DRAW: all(each.draws == 1 for each in outcomes.conditions),
        _NO_PAIRS: any(not each.paired for each in outcomes.differences),
        _NUMBERS: _differ(outcomes.conditions, "episodes"),
        _TIMES: _differ(outcomes.conditions, "operator_time"),
    }


def _differ(conditions: Sequence[ConditionOutcome], name: str) -> bool:
    """Return whether what the policies were trained on differs by more than 5 %."""
    values = [each.trained_on[name] for each in conditions if name in each.trained_on]
    return bool(values) and max(values) > 1.05 * min(values)

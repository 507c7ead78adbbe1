"""The answer of a comparison in a sentence or two, never more than the intervals; and what limits it."""

from collections.abc import Iterator
from itertools import islice

from handrail.datasets.comparison.collection import SUCCESS
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.policies import Outcomes
from handrail.datasets.presentation.wording import number, percent, percent_span, points_span, span
from handrail.datasets.statistics.contrast import SHARE, Contrast

_MOST = 3  # differences that are named; the tables have all
_UNKNOWN = "Whether episodes succeeded was not recorded for all of them."


def headline(comparison: Comparison) -> str:
    """Return the answer: of the policies if they were evaluated, else of what was collected."""
    if comparison.unlike:
        differing = " and the ".join(comparison.unlike)
        return f"The {differing} differ: what follows describes each group and ranks nothing."
    outcomes = comparison.outcomes
    told = _of_policies(outcomes) if outcomes else _of_collecting(comparison)
    return " ".join(islice(dict.fromkeys(told), _MOST))


def _of_policies(outcomes: Outcomes) -> Iterator[str]:
    shares = {each.label: percent(each.share) for each in outcomes.conditions}
    for each in outcomes.differences:
        yield _told(each, shares[each.label], shares[each.baseline])
    for each in outcomes.conditions if not outcomes.differences else ():
        told = f"{each.label} {shares[each.label]} (95 % {percent_span(each.nested or each.wilson)})"
        yield f"Success of policies: {told}, compared with no other."


def _of_collecting(comparison: Comparison) -> Iterator[str]:
    collected = {each.label: each for each in comparison.everything.collected}
    for each in (
        each for label in comparison.others for each in comparison.collecting if each.label == label
    ):
        sides = collected[each.label], collected[each.baseline]
        if each.measure is SUCCESS:
            yield _UNKNOWN if each.reason else _told(each, *(percent(side.success) for side in sides))
        elif not each.reason:
            yield _told(each, *(number(side.successes_an_hour) for side in sides))


def _told(each: Contrast, one: str, other: str) -> str:
    interval, share = each.nested or each.interval, each.measure.unit == SHARE
    gap = f"difference {points_span(interval)} points" if share else f"ratio {span(interval)}"
    sides = f"{each.label} {one}, {each.baseline} {other}"
    seen = "a" if each.detected else "no"
    return f"{each.measure.title.capitalize()}: {sides}; {gap} (95 %), {seen} difference detected."


def cautions(comparison: Comparison) -> list[str]:
    """Return the limits of the headline."""
    groups, differences = comparison.everything.groups, comparison.everything.differences
    moving = [each for each in differences if each.measure.needs in ("motion", "position")]
    rates, fewest = {group.info.fps for group in groups}, min(len(group.episodes) for group in groups)
    limits = [
        (len(rates) > 1 and any(each.tested for each in moving), _RATES),
        (any(each.incomparable for each in differences), _UNITS),
        (fewest < 20, _FEW),
    ]
    training = _of_training(comparison.outcomes) if comparison.outcomes else [(True, _NO_POLICIES)]
    return [text for holds, text in [*training, *limits] if holds]


def _of_training(outcomes: Outcomes) -> list[tuple[bool, str]]:
    """Return whether a limit of the policies' intervals and tests holds, and its text."""
    conditions = outcomes.conditions
    amounts = [
        [each.trained_on[name] for each in conditions if name in each.trained_on]
        for name in ("episodes", "operator_time")
    ]
    return [
        (min(len(each.seeds) for each in conditions) < 5, _FEW_SEEDS),
        (all(each.draws == 1 for each in conditions), _ONE_DRAW),
        (any(not each.paired for each in outcomes.differences), _NO_PAIRS),
        (any(max(known) > 1.05 * min(known) for known in amounts if known), _AMOUNTS),
    ]


_NO_POLICIES = (
    "No evaluations were given: nothing here says from which data policies learn more. Quality metrics"
    " describe data and have often misjudged that."
)
_RATES = "Frame rates differ: smoothness and idle time are only roughly comparable."
_UNITS = "Some metrics are not compared, because their units may differ: the report has a table of them."
_FEW = "A group has fewer than 20 episodes: intervals of means are rough."
_FEW_SEEDS = "Fewer than 5 training seeds of a condition: the seed alone moves success by 10 to 15 points."
_ONE_DRAW = "One draw of each dataset: how much another recording would differ is not in the intervals."
_NO_PAIRS = "Training or evaluation seeds differ between conditions: rollouts were not compared as pairs."
_AMOUNTS = "The policies were trained on different amounts of data, which alone can make them differ."

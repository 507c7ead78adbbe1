"""The answer of a comparison in a sentence or two, never more than the intervals; and what limits it."""

from collections.abc import Iterator, Mapping, Sequence

from handrail.datasets.comparison.collection import SUCCESS
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.policies import Outcomes
from handrail.datasets.comparison.report import sentence
from handrail.datasets.presentation.wording import number, percent, percent_span
from handrail.datasets.statistics.contrast import SHARE, Contrast, Value

_MOST = 3  # differences that are named, detected ones first; the tables have all


def headline(comparison: Comparison) -> str:
    """Return the answer: of the policies if they were evaluated, else of what was collected."""
    if comparison.unlike:
        differing = " and the ".join(comparison.unlike)
        return f"The {differing} differ: each group is described, none is ranked."
    outcomes = comparison.outcomes
    told = [*dict.fromkeys(_of_policies(outcomes) if outcomes else _of_collecting(comparison))]
    more = [f"The tables have {len(told) - _MOST} more."] if len(told) > _MOST else []
    return " ".join(told[:_MOST] + more)


def _of_policies(outcomes: Outcomes) -> Iterator[str]:
    values = outcomes.successes
    yield from _told(_first(outcomes.differences), values)
    for each in values.values() if not outcomes.differences else ():
        told = f"{each.label} {percent(each.estimate)} (95 % {percent_span(each.widest)})"
        yield f"Success of policies: {told}, compared with no other."


def _of_collecting(comparison: Comparison) -> Iterator[str]:
    known = [each for each in comparison.collecting if not each.reason or each.measure is SUCCESS]
    values = {(each.label, each.measure): each for each in comparison.everything.collecting}
    for each in _first([each for label in comparison.others for each in known if each.label == label]):
        sides = {side: values[side, each.measure] for side in (each.label, each.baseline)}
        yield from _told([each], sides)


def _first(contrasts: Sequence[Contrast]) -> list[Contrast]:
    """Return contrasts, those in which a difference was detected first."""
    return sorted(contrasts, key=lambda each: not each.detected)


def _told(contrasts: Sequence[Contrast], values: Mapping[str, Value]) -> Iterator[str]:
    for each in contrasts:
        text = percent if each.measure.unit == SHARE else number
        sides = (f"{side} {text(values[side].estimate)}" for side in (each.label, each.baseline))
        yield sentence(each, each.measure.title.capitalize(), *sides)


def cautions(comparison: Comparison) -> dict[str, bool]:
    """Return what limits the headline, and whether it does."""
    groups, differences = comparison.everything.groups, comparison.everything.differences
    metrics = comparison.everything.measurements.metrics
    rough = [each.name for each in metrics if each.needs in ("position", "scale")]
    rates, fewest = {group.info.fps for group in groups}, min(len(group.episodes) for group in groups)
    outcomes = comparison.outcomes
    conditions = [*outcomes.conditions.values()] if outcomes else []
    policies = [each.content for each in conditions]
    rollouts = [{len(run.values) for run in each.runs()} for each in conditions]
    learnt = [policy.trained_on for each in conditions for policy in each.policies]
    amounts = [[each[name] for each in learnt if name in each] for name in ("episodes", "operator_time")]
    return {
        _NO_POLICIES: not policies,
        _FEW_SEEDS: any(len(each["seeds"]) < 5 for each in policies),
        _ONE_DRAW: bool(policies) and all(each["draws"] == 1 for each in policies),
        _NO_PAIRS: any(not each.paired for each in outcomes.differences) if outcomes else False,
        _AMOUNTS: any(max(known) > 1.05 * min(known) for known in amounts if known),
        _SEVERAL: any(_people(group) > 1 for group in groups)
        and any(each.interval and not each.paired for each in differences),
        _ROLLOUTS: any(len(each) > 1 for each in rollouts),
        _RATES: len(rates) > 1 and any(e.interval for e in differences if e.measure.name in rough),
        _UNITS: any(each.incomparable for each in differences),
        _FEW: fewest < 20,
    }


def _people(group: Group) -> int:
    """Return how many people, or scripted persons, steered a group's episodes, as far as they say."""
    return len({(each.meta.get("participant"), each.meta.get("person")) for each in group.episodes})


_NO_POLICIES = (
    "No evaluations were given: nothing here says from which data policies learn more. Quality metrics"
    " describe data and have often misjudged that."
)
_RATES = "Frame rates differ: idle time and what the operator put in are only roughly comparable."
_UNITS = "Some metrics are not compared, because their units may differ: the report has a table of them."
_FEW = "A group has fewer than 20 episodes: intervals of means are rough."
_SEVERAL = "Several persons steered: their own episodes are alike, but intervals take them for independent."
_ROLLOUTS = (
    "Policies of a condition have different numbers of rollouts; intervals of these policies pool them."
)
_FEW_SEEDS = "Fewer than 5 training seeds of a condition: the seed alone moves success by 10 to 15 points."
_ONE_DRAW = "One draw of each dataset: how much another recording would differ is not in the intervals."
_NO_PAIRS = "Training or evaluation seeds differ between conditions: rollouts were not compared as pairs."
_AMOUNTS = "The policies were trained on different amounts of data, which alone can make them differ."

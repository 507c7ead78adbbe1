"""What a comparison leaves out, and what stands in the way of reading it as it is meant."""

from collections.abc import Sequence

from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.outcomes import ConditionOutcome, Outcomes

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


def cautions(comparison: Comparison) -> list[str]:
    """Return what a reader has to know beside the headline."""
    groups, differences = comparison.everything.groups, comparison.everything.differences
    moving = [each for each in differences if each.metric.needs in ("motion", "position")]
    rates = len({group.info.fps for group in groups}) > 1
    known = {
        _NO_POLICIES: comparison.outcomes is None,
        **(_of_training(comparison.outcomes) if comparison.outcomes else {}),
        _RATES: rates and any(each.tested and not each.reason for each in moving),
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
        _NO_PAIRS: any(not each.rollouts.paired for each in outcomes.differences),
        _NUMBERS: _differ(outcomes.conditions, "episodes"),
        _TIMES: _differ(outcomes.conditions, "operator_time"),
    }


def _differ(conditions: Sequence[ConditionOutcome], name: str) -> bool:
    """Return whether what the policies were trained on differs by more than 5 %."""
    values = [each.trained_on[name] for each in conditions if name in each.trained_on]
    return bool(values) and max(values) > 1.05 * min(values)

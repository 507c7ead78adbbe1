"""Which metric says beforehand how policies will do, in words and as a table."""

from collections.abc import Sequence

from handrail.datasets.comparison.prediction import MetricPrediction
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.presentation.wording import DASH, number, p_value, span
from handrail.datasets.statistics.ranks import RankCorrelation

_CAPTION = (
    "Spearman's ρ of ranks within each task, 95 % and p after Holm over all metrics. Between modes: each mode"
    " is the mean of its recordings. Between recordings: of one mode and task, all of them together. ρ is not"
    " cause: modes differ in much else. A metric that goes with success here was chosen among many."
)


def prediction_words(found: Sequence[MetricPrediction]) -> str:
    """Return which metrics were seen to go with success, and that the others may too."""
    seen = [each for each in found if each.detected]
    if not any(each.between or each.within for each in found):
        return (
            "Which metric predicts success cannot be said: that takes policies of two recordings of a task."
        )
    if not seen:
        return (
            f"No metric of the demonstrations was seen to predict success, of {len(found)}. With so few"
            " recordings that does not show that none does: look at the intervals."
        )
    told = ", ".join(f"{each.title}{_against(each)}" for each in seen)
    return f"Of {len(found)} metrics of the demonstrations these were seen to go with success: {told}."


def prediction_table(found: Sequence[MetricPrediction]) -> Table:
    """Return how the ranks of each metric go with those of success, the closest first."""
    headings = ("metric", "thought better", "between modes", "modes", "between recordings", "recordings")
    rows = [
        [
            each.title,
            each.good or DASH,
            _cell(each.between, each.p_between, each.between_detected),
            str(each.between.units) if each.between else DASH,
            _cell(each.within, each.p_within, each.within_detected),
            str(each.within.units) if each.within else DASH,
        ]
        for each in found
    ]
    return Table(headings, rows, "Which metric predicts success", _CAPTION)


def _cell(found: RankCorrelation | None, p: float, detected: bool) -> Cell:
    if found is None:
        return Cell(DASH, "quiet", "nothing varies, or there is one of each")
    look = "detected" if detected else ""
    return Cell(number(found.estimate), look, below=f"{span(found.interval)}; {p_value(p)}")


def _against(each: MetricPrediction) -> str:
    """Return that a metric went the other way than was thought, or nothing."""
    part = each.between if each.between_detected else each.within
    thought = {"higher": 1.0, "lower": -1.0}.get(each.good, 0.0)
    return " (the other way than was thought)" if part and thought * part.estimate < 0.0 else ""

"""Which metric says beforehand how policies will do, in words and as a table."""

from collections.abc import Sequence

from handrail.datasets.comparison.prediction import MetricPrediction
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.presentation.wording import DASH, number, p_value, signed, span
from handrail.datasets.statistics.proportions import LEVEL
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
    told = ", ".join(f"{each.title} ({_how(each)})" for each in seen)
    words = f"Of {len(found)} metrics of the demonstrations these were seen to go with success: {told}."
    if not seen:
        words = (
            f"No metric of the demonstrations was seen to predict success, of {len(found)}. That does not"
            " show that none does: look at the intervals."
        )
    return words + _impossible(found)


def prediction_table(found: Sequence[MetricPrediction]) -> Table:
    """Return how the ranks of each metric go with those of success, the closest first."""
    headings = (
        "metric",
        "thought better",
        "between modes",
        "modes",
        "between recordings of a mode",
        "recordings",
    )
    rows = [
        [
            each.title,
            each.good or DASH,
            _cell(each.between, each.p_between, each.between_detected),
            str(each.between.blocks) if each.between else DASH,
            _cell(each.within, each.p_within, each.within_detected),
            str(each.within.blocks) if each.within else DASH,
        ]
        for each in found
    ]
    return Table(headings, rows, "Which metric predicts success", _CAPTION)


def _cell(found: RankCorrelation | None, p: float, detected: bool) -> Cell:
    if found is None:
        return Cell(DASH, "quiet", "nothing varies, or there is one of each")
    look = "detected" if detected else ""
    return Cell(number(found.estimate), look, below=f"{span(found.interval)}; {p_value(p)}")


def _how(each: MetricPrediction) -> str:
    """Return where a metric goes with success, and whether the other way than was thought."""
    thought = {"higher": 1.0, "lower": -1.0}.get(each.good, 0.0)
    sides = {
        "between modes": each.between if each.between_detected else None,
        "between recordings of a mode": each.within if each.within_detected else None,
    }
    return "; ".join(
        f"{where}, ρ {signed(part.estimate)}"
        + (", the other way than was thought" if thought * part.estimate < 0.0 else "")
        for where, part in sides.items()
        if part
    )


def _impossible(found: Sequence[MetricPrediction]) -> str:
    """Return that so few modes or recordings cannot show anything, whatever the metric."""
    words = ""
    for where, name in (("between", "modes"), ("within", "recordings of a mode")):
        known = [part for each in found if (part := getattr(each, where))]
        least = min((part.least_p for part in known), default=0.0)
        if least * len(known) >= LEVEL:
            most = max(part.blocks for part in known)
            words += (
                f" Between {name} none can be, with {most} of them and {len(known)} metrics: even"
                " if the ranks agree wholly, that is not rare enough."
            )
    return words

"""What the quality metrics say of groups of episodes."""

from collections.abc import Iterator

from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.differences import Difference
from handrail.datasets.comparison.finding import Finding
from handrail.datasets.presentation.wording import number, p_value, signed, span, unit

_SHOWN = 6  # metrics in words; the table has all


def quality_findings(comparison: Comparison) -> Iterator[Finding]:
    """Return what differs, what was not seen to differ, and what is only described, group by group."""
    ranked = not comparison.unlike
    for label in comparison.success:
        mine = [
            d for d in comparison.everything.differences if d.label == label and d.tested and not d.reason
        ]
        detected = sorted((d for d in mine if d.detected), key=lambda d: -abs(d.effect[0]))
        for difference in detected[:_SHOWN]:
            yield Finding("quality", _metric(difference, ranked), detected=True)
        rest = [d.metric.title for d in mine if not d.detected]
        if len(detected) > _SHOWN:
            more = f"{len(detected) - _SHOWN} more differences between {label} and {comparison.baseline}"
            yield Finding("quality", f"{more} are in the table.", detected=True)
        if rest:
            text = f"{label} and {comparison.baseline}: no difference detected in {', '.join(rest)}."
            yield Finding("quality", f"{text} That is not evidence of equality.")
        yield from _described(comparison, label)


def _described(comparison: Comparison, label: str) -> Iterator[Finding]:
    """Return what metrics of a whole group say, at the same number of episodes: in words, without a test."""
    view, told, count = comparison.same_number, [], 0
    for each in view.differences:
        if each.label == label and not each.tested and not each.reason:
            values = view.means[each.metric.name]
            count = max(each.counts)
            both = f"{number(values[label].mean)} against {number(values[each.baseline].mean)}"
            told.append(f"{each.metric.title} {both}{unit(each.metric)}")
    if told:
        yield Finding(
            "quality",
            f"{label} and {comparison.baseline}, {count} episodes of each: {', '.join(told)}. These depend on"
            " the number of episodes and are described, not tested: no difference is claimed.",
        )


def _metric(difference: Difference, ranked: bool) -> str:
    metric = difference.metric
    word = "higher" if difference.estimate > 0 else "lower"
    judged = (
        f", the {'better' if word == metric.good else 'worse'} direction" if metric.good and ranked else ""
    )
    text = (
        f"{difference.label}: {metric.title} is {word} than for {difference.baseline}{judged}"
        f" ({signed(difference.estimate)}{unit(metric)}, 95 % {span(difference.interval)},"
        f" {p_value(difference.p_adjusted)} after Holm)"
    )
    if metric.name == "length" or difference.at_equal_length:
        return f"{text}."
    return f"{text}; not detected between episodes of equal length, so it may only be their length."

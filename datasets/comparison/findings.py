"""What the comparison says, in plain words that never claim more than the intervals.

"No difference detected" is not "equal": it always comes with what would have been seen.
"""

from collections.abc import Iterator, Mapping, Sequence

from handrail.datasets.comparison.cautions import cautions, unlike_caution
from handrail.datasets.comparison.collection import Collected, RateRatio
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.differences import Difference
from handrail.datasets.comparison.finding import Finding
from handrail.datasets.comparison.outcome_findings import outcome_findings
from handrail.datasets.presentation.wording import (
    duration,
    number,
    p_value,
    percent,
    points_span,
    signed,
    span,
    unit,
)
from handrail.datasets.statistics.proportions import ShareDifference, holm

_SHOWN = 6  # metrics in words; the table has all


def findings(comparison: Comparison) -> list[Finding]:
    """Return all findings, what matters most first: where tasks or robots differ, that."""
    unlike = unlike_caution(comparison)
    found = [Finding("caution", unlike, short=unlike)] if unlike else []
    found += outcome_findings(comparison.outcomes) if comparison.outcomes else []
    found += [*_collection(comparison), *_quality(comparison)]
    return found + [Finding("caution", text) for text in cautions(comparison)]


def headline(found: Sequence[Finding]) -> str:
    """Return the answer in a sentence or two: policies if they were evaluated, else what collecting gives."""
    if found[0].kind == "caution":
        return found[0].text
    for kind in ("outcome", "collection"):
        parts = [finding.short for finding in found if finding.kind == kind and finding.short]
        if parts:
            return ". ".join(parts[:3]) + "."
    return found[0].text


def _collection(comparison: Comparison) -> Iterator[Finding]:
    by_label = {each.label: each for each in comparison.everything.collected}
    adjusted = _adjusted(comparison.success)
    ratios = _adjusted(comparison.ratios)
    for label, difference in comparison.success.items():
        one, other = by_label[label], by_label[comparison.baseline]
        if difference is None:
            text = f"Whether episodes succeeded was not recorded for all of {label} and {other.label}."
            yield Finding("collection", text)
            continue
        yield _success(difference, adjusted[label], len(adjusted), one, other)
        ratio = comparison.ratios[label]
        if ratio:
            yield _rate(ratio, ratios[label], one, other)


def _adjusted(found: Mapping[str, ShareDifference | RateRatio | None]) -> dict[str, float]:
    known = {label: each.p for label, each in found.items() if each}
    return dict(zip(known, holm(list(known.values())), strict=True))


def _success(difference: ShareDifference, p: float, tests: int, one: Collected, other: Collected) -> Finding:
    low, high = difference.interval
    shares = f"{one.label} {percent(one.success)}, {other.label} {percent(other.success)}"
    told = f"{_told(one)}; {_told(other)}. Difference {points_span(difference.interval)} points (95 %)"
    if p < 0.05 and not low <= 0.0 <= high:
        word = "more" if difference.estimate > 0 else "fewer"
        short = f"With {one.label}, {word} episodes succeeded ({shares})"
        return Finding("collection", f"{short}: {told}, {p_value(p)}.", True, short)
    short = f"Collecting: no difference in success detected ({shares})"
    seen = f"one below about {100 * difference.detectable(tests):.0f} points would often go unseen"
    return Finding("collection", f"{short}: {told}; {seen}.", False, short)


def _rate(ratio: RateRatio, p: float, one: Collected, other: Collected) -> Finding:
    """Say how many times as many successes an hour gives, the larger number over the smaller."""
    if ratio.estimate < 1.0:
        ratio, one, other = ratio.inverse, other, one
    low, high = ratio.interval
    short = f"An operator hour gives {number(ratio.estimate)} times as many successes with {one.label}"
    rates = f"{number(one.successes_an_hour)} against {number(other.successes_an_hour)} with {other.label}"
    told = f"{short}: {rates}, 95 % {span(ratio.interval)} times, {p_value(p)}"
    if p < 0.05 and not low <= 1.0 <= high:
        return Finding("collection", f"{told}.", True, short)
    return Finding("collection", f"{told}; no difference detected.")


def _told(one: Collected) -> str:
    return f"{one.label} {one.successes} of {one.episodes} in {duration(one.operator_time)}"


def _quality(comparison: Comparison) -> Iterator[Finding]:
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
            values = view.measurements.values[each.metric.name]
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

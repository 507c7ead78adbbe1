"""What the comparison says, in plain words that never claim more than the intervals.

"No difference detected" is not "equal": it always comes with what would have been seen.
"""

from collections.abc import Iterator, Mapping, Sequence

from handrail.datasets.comparison.cautions import cautions, unlike_caution
from handrail.datasets.comparison.collection import Collected
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.finding import Finding
from handrail.datasets.comparison.outcome_findings import outcome_findings
from handrail.datasets.comparison.productivity import RateRatio
from handrail.datasets.comparison.quality_findings import quality_findings
from handrail.datasets.presentation.wording import duration, number, p_value, percent, points_span, span
from handrail.datasets.statistics.proportions import ShareDifference, holm


def findings(comparison: Comparison) -> list[Finding]:
    """Return all findings, what matters most first: where tasks or robots differ, that."""
    unlike = unlike_caution(comparison)
    found = [Finding("caution", unlike, short=unlike)] if unlike else []
    found += outcome_findings(comparison.outcomes) if comparison.outcomes else []
    found += [*_collection(comparison), *quality_findings(comparison)]
    return found + [Finding("caution", text) for text in cautions(comparison)]


def headline(found: Sequence[Finding]) -> str:
    """Return the answer in a sentence or two: policies if they were evaluated, else what collecting gives."""
    if found[0].kind == "caution":
        return found[0].text
    for kind in ("outcome", "collection"):
        parts = [finding.short for finding in found if finding.kind == kind and finding.short]
        if parts:
            return "; ".join(parts[:3]) + "."
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
    told = f"{_told(one)}; {_told(other)}. Difference {points_span(difference.interval)} points (95 %)"
    shares = f"{one.label} {percent(one.success)}, {other.label} {percent(other.success)}"
    if p < 0.05 and not low <= 0.0 <= high:
        word = "more" if difference.estimate > 0 else "fewer"
        text = f"With {one.label}, {word} episodes succeeded while collecting: {told}, {p_value(p)}."
        return Finding("collection", text, True, f"With {one.label}, {word} episodes succeeded ({shares})")
    text = (
        f"Success while collecting: {told}, no difference detected; one below about"
        f" {100 * difference.detectable(tests):.0f} points would often go unseen."
    )
    return Finding("collection", text, False, f"Collecting: no difference in success detected ({shares})")


def _rate(ratio: RateRatio, p: float, one: Collected, other: Collected) -> Finding:
    """Say how many times as many successes an hour gives, the larger number over the smaller."""
    if ratio.estimate < 1.0:
        ratio, one, other = ratio.inverse, other, one
    low, high = ratio.interval
    short = f"an operator hour gives {number(ratio.estimate)} times as many successes with {one.label}"
    rates = f"{number(one.successes_an_hour)} against {number(other.successes_an_hour)} with {other.label}"
    told = f"{rates}, 95 % {span(ratio.interval)} times, {p_value(p)}"
    if p < 0.05 and not low <= 1.0 <= high:
        return Finding("collection", f"{short[0].upper()}{short[1:]}: {told}.", True, short)
    return Finding("collection", f"{short[0].upper()}{short[1:]}: {told}; no difference detected.")


def _told(one: Collected) -> str:
    return f"{one.label} {one.successes} of {one.episodes} in {duration(one.operator_time)}"

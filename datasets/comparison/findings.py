"""What the comparison says, in plain words that never claim more than the intervals.

"No difference detected" is not "equal": it always comes with what would have been seen.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from handrail.datasets.comparison.collection import Collected
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.differences import Difference
from handrail.datasets.comparison.outcomes import ArmOutcome, OutcomeDifference, Outcomes
from handrail.datasets.comparison.productivity import RateRatio
from handrail.datasets.comparison.proportions import ShareDifference, holm
from handrail.datasets.comparison.wording import (
    duration,
    number,
    p_value,
    percent,
    points_span,
    signed,
    span,
    unit,
)

SEEDS = 3  # training seeds that are the least
_SHOWN = 6  # metrics in words; the table has all


@dataclass(frozen=True)
class Finding:
    """One sentence or two.

    Attributes:
        kind: `outcome`, `collection`, `quality` or `caution`.
        text: What to read.
        detected: Whether it is a difference that was detected.
        short: The same in fewer words, for a headline.
    """

    kind: str
    text: str
    detected: bool = False
    short: str = ""


def findings(comparison: Comparison) -> list[Finding]:
    """Return all findings, what matters most first."""
    found = [*outcome_findings(comparison.outcomes)] if comparison.outcomes else []
    found += [*_collection(comparison), *_quality(comparison)]
    return found + [Finding("caution", text) for text in _cautions(comparison)]


def headline(found: Sequence[Finding]) -> str:
    """Return the answer in a sentence or two: policies if they were evaluated, else what collecting gives."""
    for kind in ("outcome", "collection"):
        parts = [finding.short for finding in found if finding.kind == kind and finding.short]
        if parts:
            return "; ".join(parts[:3]) + "."
    return found[0].text


def outcome_findings(outcomes: Outcomes) -> Iterator[Finding]:
    """Return what the policies' success says, one finding for each arm that is not the baseline."""
    arms = {arm.label: arm for arm in outcomes.arms}
    for difference in outcomes.differences:
        one, other = arms[difference.label], arms[difference.baseline]
        text, short = _outcome(difference, one, other), _short(difference, one, other)
        yield Finding("outcome", text, difference.detected, short)


def _short(difference: OutcomeDifference, one: ArmOutcome, other: ArmOutcome) -> str:
    better, worse = (one, other) if one.share >= other.share else (other, one)
    low, high = difference.nested or difference.rollouts.interval
    interval = (low, high) if better is one else (-high, -low)
    shares = f"{better.label} {percent(better.share)}, {worse.label} {percent(worse.share)}"
    shares += f", difference {points_span(interval)} points"
    if not difference.detected:
        return f"Policies: no difference in success detected ({shares})"
    whose = "Policies trained on" if difference.nested else "The policy trained on"
    word = "more often" if difference.nested else "more often in one training run"
    return f"{whose} {better.label} succeeded {word} ({shares})"


def _outcome(difference: OutcomeDifference, one: ArmOutcome, other: ArmOutcome) -> str:
    shares = f"{percent(one.share)} against {percent(other.share)}"
    interval = points_span(difference.nested or difference.rollouts.interval)
    if not difference.detected:
        return (
            f"No difference in policy success was detected between {one.label} and {other.label}: {shares},"
            f" difference {interval} points (95 %; {_chance(difference)}). This does not show that they are"
            f" equal: a difference below about {100 * difference.detectable:.0f} points would often go unseen"
            " here."
        )
    word = "more" if one.share > other.share else "less"
    whose = "Policies trained on" if difference.nested else "This policy trained on"
    return (
        f"{whose} {one.label} succeed{'' if difference.nested else 's'} {word} often than"
        f" {'those' if difference.nested else 'this one'} trained on {other.label}: {shares}, difference"
        f" {interval} points (95 %; {_chance(difference)})."
    )


def _chance(difference: OutcomeDifference) -> str:
    """Say how probable such a difference is by chance; an interval alone knows nothing of the others."""
    among = f", among {difference.tests} differences" if difference.tests > 1 else ""
    return f"{p_value(difference.p_adjusted)} after Holm{among}"


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
    low, high = ratio.interval
    detected = p < 0.05 and not low <= 1.0 <= high
    text = (
        f"Successes per operator hour: {one.label} {number(one.successes_an_hour)},"
        f" {other.label} {number(other.successes_an_hour)};"
        f" {number(ratio.estimate)} times as many (95 % {span(ratio.interval)}, {p_value(p)})"
    )
    if not detected:
        return Finding("collection", f"{text}; no difference detected.")
    factor, who = (ratio.estimate, one) if ratio.estimate > 1 else (1 / ratio.estimate, other)
    short = f"an operator hour gives {number(factor)} times as many successes with {who.label}"
    return Finding("collection", f"{text}.", True, short)


def _told(one: Collected) -> str:
    return f"{one.label} {one.successes} of {one.episodes} in {duration(one.operator_time)}"


def _quality(comparison: Comparison) -> Iterator[Finding]:
    for label in comparison.success:
        mine = [
            d for d in comparison.everything.differences if d.label == label and d.tested and not d.reason
        ]
        detected = sorted((d for d in mine if d.detected), key=lambda d: -abs(d.effect[0]))
        for difference in detected[:_SHOWN]:
            yield Finding("quality", _metric(difference), detected=True)
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


def _metric(difference: Difference) -> str:
    metric = difference.metric
    word = "higher" if difference.estimate > 0 else "lower"
    judged = f", the {'better' if word == metric.good else 'worse'} direction" if metric.good else ""
    text = (
        f"{difference.label}: {metric.title} is {word} than for {difference.baseline}{judged}"
        f" ({signed(difference.estimate)}{unit(metric)}, 95 % {span(difference.interval)},"
        f" {p_value(difference.p_adjusted)} after Holm)"
    )
    if metric.name == "length" or difference.at_equal_length:
        return f"{text}."
    return f"{text}; not detected between episodes of equal length, so it may only be their length."


def _cautions(comparison: Comparison) -> Iterator[str]:
    groups = comparison.everything.groups
    if comparison.outcomes is None:
        yield (
            "No evaluations were given: nothing here says which data make the better policy. Quality metrics"
            " describe data and have often misjudged it."
        )
    else:
        yield from training_cautions(comparison.outcomes)
    if len({group.info.fps for group in groups}) > 1:
        rates = ", ".join(f"{group.label} {group.info.fps} Hz" for group in groups)
        yield f"Frame rates differ ({rates}): smoothness and idle time are only roughly comparable."
    tasks = {group.label: {str(e.meta.get("tasks")) for e in group.episodes} for group in groups}
    if len({frozenset(each) for each in tasks.values()}) > 1:
        yield "The tasks differ, so a difference may be the task's."
    if len(set(comparison.everything.measurements.pools.values())) > 1:
        yield "The datasets have different columns: metrics that need a common scale are not compared."
    few = [group.label for group in groups if len(group.episodes) < 20]
    if few:
        yield f"Few episodes ({', '.join(few)}): intervals of means are rough below about 20."


def training_cautions(outcomes: Outcomes) -> Iterator[str]:
    """Return what the policies' intervals and tests leave out."""
    few = [arm.label for arm in outcomes.arms if len(arm.seeds) < SEEDS]
    if few:
        yield (
            f"Fewer than {SEEDS} training seeds ({', '.join(few)}): the seed alone moves success by 10 to 15"
            " points, so the policies may differ where their data do not."
        )
    elif any(len(arm.seeds) < 5 for arm in outcomes.arms):
        yield "Three or four training seeds: intervals over training are still too narrow; five are better."
    if all(arm.draws == 1 for arm in outcomes.arms):
        yield "One draw of each dataset: how much another recording would differ is not in the intervals."
    if any(not difference.rollouts.paired for difference in outcomes.differences):
        yield "Training or evaluation seeds differ between arms, so rollouts were not compared as pairs."
    for name, title in (("episodes", "numbers of episodes"), ("operator_time", "operator times")):
        values = {arm.trained_on[name] for arm in outcomes.arms if name in arm.trained_on}
        if values and max(values) > 1.05 * min(values):
            yield f"The policies were trained on different {title}, which alone can make them differ."

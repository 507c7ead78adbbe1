"""The report as one page that needs nothing else: the answer first, then how it came about."""

from collections.abc import Iterable, Sequence

from handrail.datasets.comparison.collection import Collected
from handrail.datasets.comparison.compare import MIXED, Comparison
from handrail.datasets.comparison.finding import Finding
from handrail.datasets.comparison.findings import headline
from handrail.datasets.comparison.groups import group_of
from handrail.datasets.comparison.outcomes import Outcomes
from handrail.datasets.comparison.report import tables
from handrail.datasets.comparison.report.figures import (
    TURNED,
    answer_panels,
    colours,
    effects_panels,
    metrics_panels,
    trajectory_panels,
)
from handrail.datasets.comparison.report.pictures import first_pictures
from handrail.datasets.comparison.report.worst import worst_folds
from handrail.datasets.presentation.drawing import Panel, svg
from handrail.datasets.presentation.markup import (
    card,
    cards,
    folded,
    gallery,
    items,
    legend,
    page,
    panels,
    paragraph,
    section,
)
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import (
    DASH,
    duration,
    families,
    number,
    percent,
    percent_span,
    span,
)
from handrail.datasets.quality.catalogue import METRICS

_HOW = (
    "Every interval is 95 %. Shares: Wilson; their differences: Newcombe's method 10, exact McNemar test"
    " where the same seeds were tried under both, Boschloo's where not. Several trained policies that met the"
    " same scenes: “these policies” and these tests take the scene for the unit; “with training” is the wider"
    " of a nested bootstrap over dataset draw, training seed and evaluation seed and of Student's t over the"
    " policies (over draws where there are several), and Welch's t test over them has to agree."
    " Means of metrics: bootstrap over episodes and permutation tests, paired by seed where every episode has"
    " one that began alike. What needs all episodes of a group at once (action variance, state coverage,"
    " mutual information) depends on their number: it is described at the same number and not tested."
    " A difference counts as detected if its intervals leave zero out and p stays below 0.05 after"
    " Holm's correction over its family. “Detectable” is the difference that would be"
    " detected in 80 % of such experiments. ↔ marks metrics that follow the length of the episodes"
    " (Spearman's |ρ| ≥ 0.5); “same length” is the difference with that taken off by analysis of covariance."
)
_QUALITY = (
    "Each with its 95 % interval; bold: detected. These numbers describe data; they do not rank it. Point at"
    " a name for what it means, and at a dash for why there is nothing."
)
_WORST = (
    "The three of each group at the wrong end of each metric, and the command that writes the dataset without"
    " them. The slowest episode may be the one with the hardest scene: look before you leave it out."
)
_EFFECTS = (
    "Filled: detected; hollow: not. An arrow: beyond what is shown, or a difference where nothing varies."
)
_TURNED = f" {TURNED}: less is better, so the metric is drawn the other way round."


def report_page(comparison: Comparison, found: list[Finding]) -> str:
    """Return the page."""
    looks = ("caution" if f.kind == "caution" else "detected" if f.detected else "quiet" for f in found)
    said = items(zip(looks, (f.text for f in found), strict=True))
    parts = [*_first_screen(comparison, found), section("Findings", said)]
    if comparison.outcomes:
        differences = tables.outcome_differences_table(comparison.outcomes)
        parts.append(section("Policies", tables.conditions_table(comparison.outcomes), differences))
    parts += [
        section("What was collected", tables.collection_table(comparison.everything.collected)),
        section("Quality", *_quality(comparison)),
        section("Trajectories", _drawn(trajectory_panels(comparison)), _pictures(comparison)),
    ]
    missing = tables.not_applicable_table(comparison)
    parts.append(section("Episodes to look at first", paragraph(_WORST, "quiet"), worst_folds(comparison)))
    parts += [section("What does not apply, or is not comparable", missing)] if missing else []
    meanings = items(("quiet", f"{metric.title}: {metric.meaning}.") for metric in METRICS)
    how = paragraph(_HOW), paragraph(_families(comparison))
    parts.append(section("How to read this", *how, folded("What every metric means", meanings)))
    *first, last = comparison.labels
    return page(f"{', '.join(first)} and {last}, compared", *parts, what=_what(comparison))


def _drawn(shown: Iterable[Panel], look: str = "") -> str:
    return panels([(panel.title, panel.note, svg(panel.figure)) for panel in shown], look)


def _legend(comparison: Comparison) -> str:
    known = colours(comparison)
    return legend((label, known[label]) for label in comparison.labels)


def _families(comparison: Comparison) -> str:
    """Return over which comparisons Holm's correction is, by name and number."""
    others = len(comparison.success)
    tested = len([each for each in comparison.everything.differences if each.tested and not each.reason])
    told = [
        f"success while collecting ({others})",
        f"successes an hour ({others})",
        f"all metrics that are tested ({tested}; as many in each other view)",
    ]
    if comparison.outcomes and comparison.outcomes.differences:
        names = families(each.family for each in comparison.outcomes.differences)
        told.insert(0, f"the success of policies ({names.removesuffix(',')})")
    mixed = " Mixed: the policies' labels say that they differ in more than their data."
    return f"Families of Holm's correction: {'; '.join(told)}.{mixed if MIXED in told[0] else ''}"


def _what(comparison: Comparison) -> str:
    sources = sorted({str(group.info.root.name) for group in comparison.everything.groups})
    tasks = {
        task for group in comparison.everything.groups for e in group.episodes for task in e.meta["tasks"]
    }
    return f"{', '.join(sources)} – {'; '.join(sorted(tasks)[:2])}{' …' if len(tasks) > 2 else ''}"


def _first_screen(comparison: Comparison, found: list[Finding]) -> list[str]:
    shown = [_card(comparison, each) for each in comparison.everything.collected]
    answer = paragraph(headline(found), "headline")
    figure = section("", _legend(comparison), _drawn(answer_panels(comparison)))
    return [answer, cards(shown), figure]


def _card(comparison: Comparison, each: Collected) -> str:
    rates, colour = comparison.rates[each.label], colours(comparison)[each.label]
    rate = number(each.successes_an_hour) + (f" ({span(rates)})" if rates else "")
    lines = [
        f"{each.episodes} episodes in {duration(each.operator_time)} of operator time",
        f"{rate} successes per operator hour" if each.successes is not None else "success was not recorded",
    ]
    if comparison.outcomes:
        collecting = [f"collecting: {percent(each.success)}"] if each.success is not None else []
        big, first = _policies(comparison.outcomes, each.label, comparison.labels)
        return card(each.label, colour, big, [first, *collecting, *lines])
    if each.successes is None:
        return card(each.label, colour, f"{each.episodes} episodes", lines)
    first = f"succeeded while collecting, {percent_span(each.success_interval)} (95 %)"
    return card(each.label, colour, percent(each.success), [first, *lines])


def _policies(outcomes: Outcomes, label: str, labels: Sequence[str]) -> tuple[str, str]:
    """Return what a card says of a group's policies, in large and below: of the group's own name first."""
    mine = [condition for condition in outcomes.conditions if group_of(condition.label, labels) == label]
    if not mine:
        return DASH, "no policy was evaluated"
    condition = min(mine, key=lambda condition: condition.label != label)
    whose = "" if condition.label == label else f" of {condition.label}"
    interval = percent_span(condition.nested or condition.wilson)
    return percent(condition.share), f"policy success{whose}, {interval} (95 %)"


def _quality(comparison: Comparison) -> list[str | Table]:
    turned = "" if comparison.unlike else _TURNED
    parts: list[str | Table] = [
        _legend(comparison),
        _drawn(effects_panels(comparison), "wide"),
        paragraph(_EFFECTS + turned, "quiet"),
    ]
    parts += [tables.metrics_table(comparison, label) for label in comparison.success]
    parts += [paragraph(_QUALITY, "quiet"), _matched(comparison)]
    return [*parts, _drawn(metrics_panels(comparison), "small")]


def _matched(comparison: Comparison) -> str:
    """Return how much of each group the views take."""
    told = [
        f"{view.title}: " + ", ".join(f"{each.label} {each.episodes}" for each in view.collected)
        for view in comparison.views[1:]
    ]
    return paragraph(
        "“Same number” and “same time” are of the first episodes of each, as many as the smallest has, or as"
        " fit into the shortest operator time: where persons took turns, the last of them may be missing."
        f" Episodes of {'; of '.join(told)}.",
        "quiet",
    )


def _pictures(comparison: Comparison) -> str:
    if not comparison.config.pictures:
        return ""
    shown = [(group.label, gallery(first_pictures(group))) for group in comparison.everything.groups]
    return "".join(paragraph(label, "quiet") + pictures for label, pictures in shown if pictures)

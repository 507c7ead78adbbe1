"""The report as one page that needs nothing else: the answer first, then how it came about."""

from html import escape

from handrail.datasets.comparison import report_tables as tables
from handrail.datasets.comparison.collection import Collected
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.figures import answer_figure, colours, effects_figure, metrics_figure
from handrail.datasets.comparison.findings import Finding, headline
from handrail.datasets.comparison.markup import (
    card,
    cards,
    folded,
    gallery,
    items,
    page,
    paragraph,
    picture,
    section,
)
from handrail.datasets.comparison.outcomes import ArmOutcome
from handrail.datasets.comparison.pictures import first_pictures
from handrail.datasets.comparison.resampling import Interval
from handrail.datasets.comparison.trajectories import trajectories_figure
from handrail.datasets.comparison.wording import duration, number, percent, percent_span, span
from handrail.datasets.quality.catalogue import METRICS

_HOW = (
    "Every interval is 95 %. Shares: Wilson; their differences: Newcombe's method 10, exact McNemar test"
    " where the same seeds were tried under both, Boschloo's where not. Several trained policies that met the"
    " same scenes: “these policies” takes the scene for the unit; “with training” is a bootstrap over dataset"
    " draw, training seed and evaluation seed, nested, and Welch's t test over the policies has to agree."
    " Means of metrics: bootstrap over episodes and permutation tests, paired by seed where every episode has"
    " one that began alike. What needs all episodes of a group at once (action variance, state coverage,"
    " mutual information) depends on their number: it is described at the same number and not tested."
    " A difference counts as detected if its intervals leave zero out and p stays below 0.05 after"
    " Holm's correction over all comparisons of its kind. “Detectable” is the difference that would be"
    " detected in 80 % of such experiments. ↔ marks metrics that follow the length of the episodes"
    " (Spearman's |ρ| ≥ 0.5); “same length” is the difference with that taken off by analysis of covariance."
)
_QUALITY = (
    "Each with its 95 % interval; bold: detected. These numbers describe data; they do not rank it. Point at"
    " a name for what it means, and at a dash for why there is nothing."
)


def report_page(comparison: Comparison, found: list[Finding]) -> str:
    """Return the page."""
    title = _title(comparison)
    parts = [_first_screen(comparison, found), section("Findings", _findings(found))]
    if comparison.outcomes:
        shown = tables.arms_table(comparison.outcomes), tables.outcome_differences_table(comparison.outcomes)
        parts.append(section("Policies", *shown))
    parts += [
        section("What was collected", tables.collection_table(comparison.everything.collected)),
        section("Quality", *_quality(comparison)),
        section("The same number, the same time", _matched_note(), tables.matched_table(comparison.views)),
        section(
            "Trajectories",
            picture(trajectories_figure(comparison), "paths and speeds"),
            _pictures(comparison),
        ),
    ]
    missing = tables.not_applicable_table(comparison)
    parts += [section("What does not apply", missing)] if missing else []
    parts.append(section("How to read this", paragraph(_HOW), folded("What every metric means", _meanings())))
    return page(title, "".join(parts))


def _first_screen(comparison: Comparison, found: list[Finding]) -> str:
    known = colours(comparison)
    sources = sorted({str(group.info.root.name) for group in comparison.everything.groups})
    tasks = {
        task for group in comparison.everything.groups for e in group.episodes for task in e.meta["tasks"]
    }
    what = f"{', '.join(sources)} – {'; '.join(sorted(tasks)[:2])}{' …' if len(tasks) > 2 else ''}"
    arms = {arm.label: arm for arm in comparison.outcomes.arms} if comparison.outcomes else {}
    shown = [
        _card(each, arms.get(each.label), comparison.rates[each.label], known[each.label])
        for each in comparison.everything.collected
    ]
    answer = paragraph(headline(found), "headline")
    heading = f"<header><h1>{escape(_title(comparison))}</h1>{paragraph(what)}</header>"
    figure = f"<section>{picture(answer_figure(comparison), 'success')}</section>"
    return heading + answer + cards(shown) + figure


def _title(comparison: Comparison) -> str:
    *first, last = comparison.labels
    return f"{', '.join(first)} and {last}, compared"


def _card(each: Collected, arm: ArmOutcome | None, rates: Interval | None, colour: str) -> str:
    rate = number(each.successes_an_hour) + (f" ({span(rates)})" if rates else "")
    lines = [
        f"{each.episodes} episodes in {duration(each.operator_time)} of operator time",
        f"{rate} successes per operator hour" if each.successes is not None else "success was not recorded",
    ]
    if arm:
        collecting = f"collecting: {percent(each.success)}" if each.success is not None else ""
        first = f"policy success, {percent_span(arm.nested or arm.wilson)} (95 %)"
        return card(
            each.label, colour, percent(arm.share), [first, *([collecting] if collecting else []), *lines]
        )
    if each.successes is None:
        return card(each.label, colour, f"{each.episodes} episodes", lines)
    first = f"succeeded while collecting, {percent_span(each.success_interval)} (95 %)"
    return card(each.label, colour, percent(each.success), [first, *lines])


def _findings(found: list[Finding]) -> str:
    looks = [
        ("caution" if f.kind == "caution" else "detected" if f.detected else "quiet", f.text) for f in found
    ]
    return items(looks)


def _quality(comparison: Comparison) -> list[str]:
    parts = [
        picture(effects_figure(comparison), "differences in standard deviations"),
        paragraph(_QUALITY, "quiet"),
    ]
    parts += [tables.metrics_table(comparison, label) for label in comparison.success]
    return [*parts, picture(metrics_figure(comparison), "every metric, one dot an episode")]


def _matched_note() -> str:
    text = (
        "The first episodes of each, as many as the smallest has, or as fit into the shortest operator time:"
        " where persons took turns, the last of them may be missing."
    )
    return paragraph(f"{text} The columns “same number” and “same time” above are of these.", "quiet")


def _pictures(comparison: Comparison) -> str:
    if not comparison.config.pictures:
        return ""
    shown = [(group.label, gallery(first_pictures(group))) for group in comparison.everything.groups]
    return "".join(paragraph(label, "quiet") + pictures for label, pictures in shown if pictures)


def _meanings() -> str:
    return items(("quiet", f"{metric.title}: {metric.meaning}.") for metric in METRICS)

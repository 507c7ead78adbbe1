"""The tables of a comparison of datasets."""

from collections.abc import Sequence

from handrail.datasets.comparison import report
from handrail.datasets.comparison.compare import Comparison, EpisodeChoice
from handrail.datasets.comparison.episodes import FOLLOWS
from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.policies import Outcomes
from handrail.datasets.presentation import wording
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.presentation.wording import DASH, number, percent, span
from handrail.datasets.quality.metric import Metric
from handrail.datasets.quality.worst import deletion, ranked
from handrail.datasets.statistics.contrast import Contrast

_TASKS, _WORST = 2, 3  # sentences, and episodes of each metric, that are shown
_UNTESTED = "described, not tested: episodes share neighbours"


def shown_tasks(tasks: Sequence[str]) -> str:
    """Return the first task sentences."""
    return "; ".join(tasks[:_TASKS]) + (" …" if len(tasks) > _TASKS else "")


def collection_table(view: EpisodeChoice) -> Table:
    """Return the numbers of each group."""
    facts = {group.label: group.content for group in view.collected}
    reasons = {label: each["reasons"].items() for label, each in facts.items()}
    rows = {
        "episodes": {label: str(each["episodes"]) for label, each in facts.items()},
        "operator time": {label: wording.duration(each["operator_time"]) for label, each in facts.items()},
        "why not": {
            label: ", ".join(f"{reason} ({count})" for reason, count in each) or DASH
            for label, each in reasons.items()
        },
        "task": {group.label: shown_tasks(group.tasks) for group in view.collected},
        "robot": {group.label: group.info.robot_type or DASH for group in view.collected},
    }
    return report.values_table(view.collecting, rows=rows)


def collection_differences_table(comparison: Comparison) -> Table:
    """Return how each group differs from the baseline in success and in successes an hour."""
    columns = ("measure", "group", "difference", "95 %", "p, Holm", "detectable")
    return report.contrast_table(comparison.collecting, columns)


def policy_tables(outcomes: Outcomes) -> list[Table]:
    """Return how each condition's policies fared, and how they differ in success."""
    facts = {label: each.content for label, each in outcomes.conditions.items()}
    rows = {
        "rollouts": {label: f"{each['successes']} of {each['rollouts']}" for label, each in facts.items()},
        "each training seed": {
            label: ", ".join(map(percent, each["seeds"])) for label, each in facts.items()
        },
        "data": {
            label: ", ".join(f"{name} {number(value)}" for name, value in each["trained_on"].items()) or DASH
            for label, each in facts.items()
        },
    }
    columns = ("group", "difference", "95 %", wording.WITH_TRAINING, "p, Holm", "family", "detectable")
    caption = f"95 %: {wording.THESE_POLICIES}"
    differences = report.contrast_table(outcomes.differences, columns, "Success of policies", caption)
    return [report.values_table(outcomes.values, rows=rows), differences]


def metrics_table(comparison: Comparison, label: str) -> Table:
    """Return every metric of a group and the baseline, and how they differ in each view."""
    values = comparison.everything.measurements.values
    views = [{e.measure: e for e in view.differences if e.label == label} for view in comparison.views]
    sides = comparison.baseline, label
    found = [e for e in views[0].values() if any(values[e.measure.name][side].known.size for side in sides)]

    def mean(each: Contrast, side: str) -> Cell:
        return report.shown(values[each.measure.name][side])

    def title(each: Contrast) -> Cell:
        follows = abs(each.follows_length or 0.0) >= FOLLOWS and each.measure.name != "length"
        return report.measure_cell(each.measure, not comparison.unlike, " ↔" if follows else "")

    def tested(each: Contrast, shown: Cell | str) -> Cell | str:
        return shown if each.interval else Cell(DASH, "quiet", each.reason or _UNTESTED)

    columns = {
        "metric": title,
        sides[0]: lambda each: mean(each, sides[0]),
        sides[1]: lambda each: mean(each, sides[1]),
        "difference": _estimate,
        "same number": lambda each: _estimate(views[1][each.measure]),
        "same time": lambda each: _estimate(views[2][each.measure]),
        "same length": lambda each: tested(each, _at_length(each)),
        "p, Holm": lambda each: tested(each, wording.p_alone(each.p_adjusted)),
    }
    return report.contrast_table(found, (), f"{label} against {comparison.baseline}", more=columns)


def _estimate(each: Contrast) -> Cell:
    if each.incomparable:
        return Cell("not comparable", "quiet", each.reason)
    return report.difference_cell(each, span(each.interval) if each.interval else "")


def _at_length(each: Contrast) -> Cell:
    if each.measure.name == "length":
        return Cell(DASH, "quiet")
    look = "detected" if each.at_equal_length else ""
    return Cell(wording.signed(each.at_length or 0.0), look, below=span(each.at_length_interval))


def missing_table(comparison: Comparison) -> Table:
    """Return which metrics do not apply or are not comparable, to whom and why."""
    whose: dict[tuple[str, str], list[str]] = {}
    apart = [each for each in comparison.everything.differences if each.incomparable]
    for metric in comparison.everything.measurements.metrics:
        values = comparison.everything.measurements.values[metric.name].items()
        found = [
            (label if e.estimate is None else f"{label} (some episodes)", e.reason) for label, e in values
        ]
        found += [(f"{e.label} against {e.baseline}", e.reason) for e in apart if e.measure is metric]
        for label, reason in found:
            if reason:
                whose.setdefault((metric.title, reason), []).append(label)
    rows = [(title, ", ".join(labels), reason) for (title, reason), labels in whose.items()]
    return Table(("metric", "whose", "why"), rows)


def worst_table(comparison: Comparison, group: Group) -> Table:
    """Return the worst episodes of a group by every metric of which one end is better."""
    judging = (metric for metric in comparison.everything.measurements.metrics if metric.good)
    rows = [row for metric in judging if (row := _worst(comparison, group, metric))]
    return Table(("metric", "episodes (value)", "without them"), rows)


def _worst(comparison: Comparison, group: Group, metric: Metric) -> list[Cell | str]:
    values = comparison.everything.measurements.values[metric.name][group.label].values
    order = ranked(group.episodes, metric, values)
    if len({each.value for each in order}) < 2:
        return []  # nothing is worse than anything else
    worst = order[:_WORST]
    told = ", ".join(f"{each.episode.number} ({number(each.value)})" for each in worst)
    numbers = [each.episode.number for each in worst]
    return [Cell(metric.heading, "", metric.meaning), told, deletion(group.info, numbers)]

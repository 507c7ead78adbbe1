"""The tables of a comparison of datasets."""

from collections.abc import Sequence

from handrail.datasets.comparison.collection import Collected
from handrail.datasets.comparison.compare import Comparison, EpisodeChoice
from handrail.datasets.comparison.episodes import FOLLOWS, MetricContrast
from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.policies import ConditionOutcome, Outcomes
from handrail.datasets.comparison.report import contrast_table, difference_cell, measure_cell
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.presentation.wording import (
    DASH,
    THESE_POLICIES,
    WITH_TRAINING,
    duration,
    number,
    p_alone,
    percent,
    percent_span,
    signed,
    span,
)
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import Measured
from handrail.datasets.quality.metric import Metric

_TASKS = 2  # sentences that are shown
_REST = "The report has every metric, also where no difference was detected: that does not mean equal."
_UNTESTED = "described, not tested: episodes share neighbours"


def answer_tables(comparison: Comparison) -> list[Table]:
    """Return what a terminal shows: the policies if they were evaluated, what was collected, what differs."""
    outcomes = comparison.outcomes
    policies = [conditions_table(outcomes), outcome_differences_table(outcomes)] if outcomes else []
    found = [each for each in comparison.everything.differences if each.detected]
    detected = contrast_table(found, ("measure", "group", "difference", "95 %", "p, Holm"), caption=_REST)
    collecting = collection_table(comparison.everything), collection_differences_table(comparison)
    return [*policies, *collecting, detected]


def collection_table(view: EpisodeChoice) -> Table:
    """Return what each group consists of."""
    headings = ("", "episodes", "success", "95 %", "operator time", "successes / h", "why not")
    headings += ("task", "robot")
    return Table(headings, [_collected(*each) for each in zip(view.groups, view.collected, strict=True)])


def _collected(group: Group, each: Collected) -> list[str]:
    return [
        each.label,
        str(each.episodes),
        percent(each.success),
        percent_span(each.success_interval),
        duration(each.operator_time),
        number(each.successes_an_hour),
        ", ".join(f"{reason} ({count})" for reason, count in each.reasons.items()) or DASH,
        shown_tasks(group.tasks),
        group.info.robot_type or DASH,
    ]


def shown_tasks(tasks: Sequence[str]) -> str:
    """Return the first two task sentences."""
    return "; ".join(tasks[:_TASKS]) + (" …" if len(tasks) > _TASKS else "")


def collection_differences_table(comparison: Comparison) -> Table:
    """Return how each group differs from the baseline in success and in successes an hour."""
    found = [*comparison.success.values(), *comparison.ratios.values()]
    return contrast_table(found, ("measure", "group", "difference", "95 %", "p, Holm", "detectable"))


def views_table(comparison: Comparison) -> Table:
    """Return how many episodes of each group the views take."""
    rows = [[view.title, *(str(each.episodes) for each in view.collected)] for view in comparison.views]
    return Table(("", *comparison.labels), rows)


def conditions_table(outcomes: Outcomes) -> Table:
    """Return how each condition's policies fared."""
    names = list(dict.fromkeys(name for condition in outcomes.conditions for name in condition.means))
    headings = ("trained on", "success", THESE_POLICIES, WITH_TRAINING, "each training seed", "data")
    headings += tuple(f"{name} / 100 rollouts" if name == "contacts" else name for name in names)
    rows = [
        [
            condition.label,
            f"{condition.successes} of {condition.rollouts}: {percent(condition.share)}",
            percent_span(condition.wilson),
            percent_span(condition.nested),
            ", ".join(percent(share) for share in condition.seeds),
            ", ".join(f"{name} {number(value)}" for name, value in condition.trained_on.items()) or DASH,
            *(_outcome(condition, name) for name in names),
        ]
        for condition in outcomes.conditions
    ]
    return Table(headings, rows)


def _outcome(condition: ConditionOutcome, name: str) -> Cell | str:
    if name not in condition.means:
        return Cell(DASH, "quiet", "not every rollout has it")
    mean, (low, high) = condition.means[name]
    factor = 100.0 if name == "contacts" else 1.0
    return Cell(number(factor * mean), below=span((factor * low, factor * high)))


def outcome_differences_table(outcomes: Outcomes) -> Table:
    """Return how conditions differ in success."""
    columns = ("group", "difference", "95 %", WITH_TRAINING, "p, Holm", "family", "detectable")
    return contrast_table(outcomes.differences, columns, "Success of policies", f"95 %: {THESE_POLICIES}")


def metrics_table(comparison: Comparison, label: str) -> Table:
    """Return every metric of a group and the baseline, and how they differ in each view."""
    headings = ("metric", comparison.baseline, label)
    headings += ("difference", "same number", "same time", "same length", "p, Holm")
    rows = [row for metric in METRICS if (row := _metric(comparison, metric, label))]
    return Table(headings, rows, f"{label} against {comparison.baseline}")


def _metric(comparison: Comparison, metric: Metric, label: str) -> list[Cell | str]:
    means = comparison.everything.measurements.values[metric.name]
    one, other = means[label], means[comparison.baseline]
    if one.mean is None and other.mean is None:
        return []
    views = [each for each in comparison.metric_contrasts if (each.measure, each.label) == (metric, label)]
    every = views[0]
    reason = Cell(DASH, "quiet", every.reason or _UNTESTED)
    follows = abs(every.follows_length or 0.0) >= FOLLOWS and metric.name != "length"
    at_length = Cell(
        signed(every.at_length or 0.0),
        "detected" if every.at_equal_length else "",
        below=span(every.at_length_interval),
    )
    return [
        measure_cell(metric, ranked=not comparison.unlike, mark=" ↔" if follows else ""),
        _mean(other),
        _mean(one),
        *map(_estimate, views),
        at_length if every.tested and metric.name != "length" else reason,
        p_alone(every.p_adjusted) if every.tested else reason,
    ]


def _mean(mean: Measured) -> Cell:
    if mean.mean is None:
        return Cell("does not apply", "quiet", mean.reason)
    return Cell(number(mean.mean), below=span(mean.interval) if mean.interval else "")


def _estimate(each: MetricContrast) -> Cell:
    if each.incomparable:
        return Cell("not comparable", "quiet", each.reason)
    if each.reason:
        return Cell(DASH, "quiet", each.reason)
    found = difference_cell(each)
    return Cell(
        found.text,
        found.look,
        "" if each.tested else _UNTESTED,
        below=span(each.interval) if each.interval else "",
    )


def not_applicable_table(comparison: Comparison) -> Table | None:
    """Return which metrics do not apply or are not comparable, to whom and why; None if all are."""
    rows = []
    for metric in METRICS:
        reasons: dict[str, list[str]] = {}
        for label, mean in comparison.everything.measurements.values[metric.name].items():
            if mean.reason:
                whose = label if mean.mean is None else f"{label} (some episodes)"
                reasons.setdefault(mean.reason, []).append(whose)
        for each in comparison.everything.differences:
            if each.measure is metric and each.incomparable:
                reasons.setdefault(each.reason, []).append(f"{each.label} against {each.baseline}")
        rows += [[metric.title, ", ".join(labels), reason] for reason, labels in reasons.items()]
    return Table(("metric", "whose", "why"), rows) if rows else None

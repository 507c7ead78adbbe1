"""The tables of the page."""

from collections.abc import Sequence

from handrail.datasets.comparison.collection import Collected, adjusted, detected
from handrail.datasets.comparison.compare import Comparison, EpisodeChoice
from handrail.datasets.comparison.differences import FOLLOWS, Difference
from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.outcomes import ConditionOutcome, Outcomes
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.presentation.wording import (
    DASH,
    THESE_POLICIES,
    WITH_TRAINING,
    duration,
    number,
    p_alone,
    p_value,
    percent,
    percent_span,
    points,
    points_span,
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
    collecting = collection_table(comparison.everything), collection_differences_table(comparison)
    return [*policies, *collecting, _detected_table(comparison)]


def _detected_table(comparison: Comparison) -> Table:
    """Return the metrics in which a difference was detected."""
    view, base = comparison.everything, comparison.baseline
    means = view.measurements.values
    rows = [
        [
            Cell(each.metric.title, below=_below(each.metric, ranked=not comparison.unlike)),
            _mean(means[each.metric.name][base]),
            each.label,
            _mean(means[each.metric.name][each.label]),
            p_alone(each.p_adjusted),
        ]
        for each in view.differences
        if each.detected
    ]
    return Table(("differs", base, "", "mean, 95 %", "p, Holm"), rows, caption=_REST)


def collection_table(view: EpisodeChoice) -> Table:
    """Return what each group consists of."""
    headings = ("", "episodes", "success", "95 %", "operator time", "successes / h", "why not")
    headings += ("task", "robot")
    rows = [_collected(*each) for each in zip(view.groups, view.collected, strict=True)]
    return Table(headings, rows)


def _collected(group: Group, each: Collected) -> list[str]:
    reasons = ", ".join(f"{reason} ({count})" for reason, count in each.reasons.items())
    return [
        each.label,
        str(each.episodes),
        percent(each.success),
        percent_span(each.success_interval),
        duration(each.operator_time),
        number(each.successes_an_hour),
        reasons or DASH,
        shown_tasks(group.tasks),
        group.info.robot_type or DASH,
    ]


def shown_tasks(tasks: Sequence[str]) -> str:
    """Return the first two task sentences."""
    return "; ".join(tasks[:_TASKS]) + (" …" if len(tasks) > _TASKS else "")


def collection_differences_table(comparison: Comparison) -> Table:
    """Return how each group differs from the baseline in success and in successes an hour."""
    headings = ("while collecting", "success", "95 %", "p, Holm", "detectable")
    headings += ("successes / h", "95 %", "p, Holm")
    rows = [_collection_difference(comparison, label) for label in comparison.success]
    return Table(headings, rows)


def _collection_difference(comparison: Comparison, label: str) -> list[Cell | str]:
    success, ratio = comparison.success[label], comparison.ratios[label]
    row: list[Cell | str] = [f"{label} against {comparison.baseline}", *[DASH] * 7]
    if success:
        p = adjusted(comparison.success)[label]
        look = "detected" if detected(success.interval, p) else ""
        seen = f"{100 * success.detectable(len(comparison.success)):.0f} points"
        estimate = Cell(f"{points(success.estimate)} points", look)
        row[1:5] = estimate, points_span(success.interval), p_alone(p), seen
    if ratio:
        p = adjusted(comparison.ratios)[label]
        look = "detected" if detected(ratio.interval, p, 1.0) else ""
        row[5:] = Cell(f"× {number(ratio.estimate)}", look), span(ratio.interval), p_alone(p)
    return row


def views_table(comparison: Comparison) -> Table:
    """Return how many episodes of each group the views take."""
    rows = [[view.title, *(str(each.episodes) for each in view.collected)] for view in comparison.views]
    return Table(("", *comparison.labels), rows)


def conditions_table(outcomes: Outcomes) -> Table:
    """Return how each condition's policies fared."""
    names = list(dict.fromkeys(name for condition in outcomes.conditions for name in condition.means))
    headings = (
        "trained on",
        "success",
        THESE_POLICIES,
        WITH_TRAINING,
        "each training seed",
        "data",
        *map(_heading, names),
    )
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


def _heading(name: str) -> str:
    return f"{name} / 100 rollouts" if name == "contacts" else name


def _outcome(condition: ConditionOutcome, name: str) -> Cell | str:
    if name not in condition.means:
        return Cell(DASH, "quiet", "not every rollout has it")
    mean, (low, high) = condition.means[name]
    factor = 100.0 if name == "contacts" else 1.0
    return Cell(number(factor * mean), below=span((factor * low, factor * high)))


def outcome_differences_table(outcomes: Outcomes) -> Table:
    """Return how conditions differ in success."""
    headings = ("", "difference", THESE_POLICIES, WITH_TRAINING, "test", "p after Holm", "detectable")
    rows = [
        [
            f"{each.label} − {each.baseline}",
            Cell(f"{points(each.rollouts.estimate)} points", "detected" if each.detected else ""),
            points_span(each.rollouts.interval),
            points_span(each.nested) if each.nested else DASH,
            ("McNemar" if each.rollouts.paired else "Boschloo")
            + (" by scene, bootstrap, Welch" if each.nested else ""),
            Cell(p_value(each.p_adjusted), below=f"over {each.tests} {each.family}"),
            f"{100 * each.detectable:.0f} points",
        ]
        for each in outcomes.differences
    ]
    return Table(headings, rows)


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
    every, number_, time = (_of(view, metric, label) for view in comparison.views)
    reason = Cell(DASH, "quiet", every.reason or _UNTESTED)
    untested = bool(every.reason) or not every.tested
    follows = abs(every.follows_length) >= FOLLOWS and metric.name != "length"
    name = metric.title + (" ↔" if follows else "")
    return [
        Cell(name, "", metric.meaning, _below(metric, ranked=not comparison.unlike)),
        _mean(other),
        _mean(one),
        *([_estimate(each) for each in (every, number_, time)]),
        reason if untested or metric.name == "length" else _at_length(every),
        reason if untested else p_alone(every.p_adjusted),
    ]


def _below(metric: Metric, ranked: bool) -> str:
    judged = f"{metric.good} is better" if metric.good and ranked else ""
    return " · ".join(part for part in (metric.unit, judged) if part)


def _at_length(each: Difference) -> Cell:
    look = "detected" if each.at_equal_length else ""
    return Cell(signed(each.at_length), look, below=span(each.at_length_interval))


def _of(view: EpisodeChoice, metric: Metric, label: str) -> Difference:
    (found,) = [each for each in view.differences if each.metric is metric and each.label == label]
    return found


def _mean(mean: Measured) -> Cell:
    if mean.mean is None:
        return Cell("does not apply", "quiet", mean.reason)
    return Cell(number(mean.mean), below=span(mean.interval) if mean.interval else "")


def _estimate(each: Difference) -> Cell:
    if each.reason:
        return Cell("not comparable" if each.incomparable else DASH, "quiet", each.reason)
    if not each.tested:
        return Cell(signed(each.estimate), "", _UNTESTED)
    look = "detected" if each.detected else ""
    return Cell(signed(each.estimate), look, below=span(each.interval))


def not_applicable_table(comparison: Comparison) -> Table | None:
    """Return which metrics do not apply or are not comparable, to whom and why; None if all are."""
    rows = []
    for metric in METRICS:
        reasons: dict[str, list[str]] = {}
        for label, mean in comparison.everything.measurements.values[metric.name].items():
            if mean.reason:
                who = label if mean.mean is None else f"{label} (some episodes)"
                reasons.setdefault(mean.reason, []).append(who)
        for each in comparison.everything.differences:
            if each.metric is metric and each.incomparable:
                reasons.setdefault(each.reason, []).append(f"{each.label} against {each.baseline}")
        rows += [[metric.title, ", ".join(labels), reason] for reason, labels in reasons.items()]
    return Table(("metric", "whose", "why"), rows) if rows else None

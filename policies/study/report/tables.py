"""The tables of a study, for a page in HTML and one in Markdown alike."""

from collections.abc import Mapping

from handrail.datasets.comparison.outcomes import ConditionOutcome, OutcomeDifference
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import (
    DASH,
    THESE_POLICIES,
    WITH_TRAINING,
    duration,
    number,
    p_value,
    percent,
    percent_span,
    points,
    points_span,
)
from handrail.policies.study.report.conditions import StudyCondition
from handrail.policies.study.report.results import TaskResults
from handrail.policies.study.report.treatments import ConditionResult


def tables(results: TaskResults) -> list[Table]:
    """Return the tables of a task that have something in them."""
    made = [
        _collected(results),
        _policies(results),
        _differences(results),
        _treatments(results),
        _sweep(results),
    ]
    return [table for table in made if table.rows]


def _collected(results: TaskResults) -> Table:
    headings = (
        "mode", "episodes", "success", "95 %", "operator time", "s a success", "successes / h", "failures",
    )  # fmt: skip
    rows = []
    for mode, each in results.collected.items():
        seconds = each.operator_time / each.successes if each.successes else None
        reasons = ", ".join(f"{reason} ({count})" for reason, count in each.reasons.items())
        rows.append(
            (
                mode,
                str(each.episodes),
                percent(each.success),
                percent_span(each.success_interval),
                duration(each.operator_time),
                number(seconds),
                number(each.successes_an_hour),
                reasons or DASH,
            )
        )
    return Table(headings, rows, "Collecting")


def _policies(results: TaskResults) -> Table:
    headings = (
        "policy", "what drives", "success", THESE_POLICIES, WITH_TRAINING, "each training seed", "length s",
        "rollouts with contact", "trained on",
    )  # fmt: skip
    rows = []
    for label, found in results.undisturbed.items():
        outcome = found.outcome
        length = f"{number(outcome.means['length'][0])}" if "length" in outcome.means else DASH
        rows.append(
            (
                label,
                found.condition.driven,
                _share(outcome),
                percent_span(outcome.wilson),
                percent_span(outcome.nested),
                ", ".join(percent(share) for share in outcome.seeds),
                length,
                percent(found.touched),
                _data(outcome.trained_on),
            )
        )
    return Table(headings, rows, "Policies, undisturbed")


def _differences(results: TaskResults) -> Table:
    headings = (
        "policy",
        "against",
        "what is compared",
        "points",
        THESE_POLICIES,
        WITH_TRAINING,
        "p (Holm)",
        "detectable",
    )
    found = [
        (results_[each.label], each)
        for outcomes, results_ in (
            (results.policies, results.undisturbed),
            (results.shielded, results.protected),
        )
        for each in (outcomes.differences if outcomes else ())
    ]
    found.sort(key=lambda pair: pair[0].condition.actions == "intent")  # like for like first
    return Table(headings, [_difference(each, what.condition) for what, each in found], "Differences")


def _difference(each: OutcomeDifference, condition: StudyCondition) -> tuple[str, ...]:
    alike = (
        f"joint velocities, both through the {condition.treatment}"
        if condition.treatment
        else condition.driven
    )
    return (
        each.label,
        each.baseline,
        "policy plus controller" if condition.actions == "intent" else alike,
        points(each.rollouts.estimate) + (" ●" if each.detected else ""),
        points_span(each.rollouts.interval),
        DASH if each.nested is None else points_span(each.nested),
        p_value(each.p_adjusted).removeprefix("p = ").removeprefix("p "),
        f"{100 * each.detectable:.0f} points",
    )


def _treatments(results: TaskResults) -> Table:
    headings = (
        "policy",
        "disturbed or protected by",
        "success",
        THESE_POLICIES,
        "without",
        "points",
        "points 95 %",
        "rollouts with contact",
        "contacts / 100 rollouts",
    )
    rows = [_treatment(each) for each in (*results.disturbed.values(), *results.protected.values())]
    return Table(headings, rows, "Disturbed, protected; beside the same rollouts without")


def _treatment(each: ConditionResult) -> tuple[str, ...]:
    return (
        each.condition.label,
        each.condition.treatment,
        _share(each.outcome),
        percent_span(each.outcome.wilson),
        _share(each.without) if each.without else DASH,
        points(each.change.estimate) if each.change else DASH,
        points_span(each.change.interval) if each.change else DASH,
        percent(each.touched),
        number(100 * each.contacts),
    )


def _sweep(results: TaskResults) -> Table:
    headings = (
        "policy",
        "operator's noise",
        "success",
        THESE_POLICIES,
        "each training seed",
        "s a demonstration",
    )
    rows = [
        (
            label,
            f"{point.noise:g}",
            _share(point.outcome),
            percent_span(point.outcome.wilson),
            ", ".join(percent(share) for share in point.outcome.seeds),
            number(point.seconds),
        )
        for label, points_ in results.sweep.items()
        for point in points_
    ]
    return Table(headings, rows, "Operators from perfect to clumsy")


def _share(condition: ConditionOutcome) -> str:
    return f"{percent(condition.share)} ({condition.successes} of {condition.rollouts})"


def _data(trained_on: Mapping[str, float]) -> str:
    parts = []
    if "episodes" in trained_on:
        parts.append(f"{trained_on['episodes']:.0f} episodes")
    if "operator_time" in trained_on:
        parts.append(duration(trained_on["operator_time"]))
    return ", ".join(parts) or DASH

"""The tables of a study, for a page in HTML and one in Markdown alike; the first three are a comparison's."""

from dataclasses import replace

from handrail.datasets.comparison.outcomes import ConditionOutcome, Outcomes
from handrail.datasets.comparison.report.tables import (
    collection_table,
    conditions_table,
    outcome_differences_table,
)
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import (
    DASH,
    THESE_POLICIES,
    number,
    percent,
    percent_span,
    points,
    points_span,
)
from handrail.policies.study.report.conditions import FAMILIES
from handrail.policies.study.report.results import ConditionResult, TaskResults


def tables(results: TaskResults) -> list[Table]:
    """Return the tables of a task that have something in them."""
    both = [each for each in (results.policies, results.shielded) if each]
    differences = [each for outcomes in both for each in outcomes.differences]
    differences.sort(key=lambda each: FAMILIES.index(each.family))
    compared = Outcomes((), tuple(differences))
    made = [
        replace(collection_table(list(results.collected.values())), title="Collecting"),
        replace(
            conditions_table(results.policies or compared),
            title="Policies, undisturbed; “intent” goes through the MPC",
        ),
        replace(outcome_differences_table(compared), title="Differences"),
        _treatments(results),
        _sweep(results),
    ]
    return [table for table in made if table.rows]


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

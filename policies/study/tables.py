"""The tables of a study, for a page in HTML and one in Markdown alike."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from handrail.datasets.comparison.outcomes import ArmOutcome, OutcomeDifference
from handrail.datasets.comparison.wording import (
    DASH,
    duration,
    number,
    p_value,
    percent,
    percent_span,
    points,
    points_span,
)
from handrail.policies.study.results import Condition, TaskResults


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        title: what it shows.
        headings: of its columns.
        rows: of text.
    """

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def tables(results: TaskResults) -> list[Table]:
    """Return the tables of a task that have something in them."""
    made = [
        _collected(results),
        _policies(results),
        _differences(results),
        _conditions(results),
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
    return Table("Collecting", headings, tuple(rows))


def _policies(results: TaskResults) -> Table:
    headings = (
        "policy", "success", "rollouts 95 %", "with training 95 %", "each training seed", "length s",
        "rollouts with contact", "trained on",
    )  # fmt: skip
    rows = []
    for label, condition in results.conditions.items():
        arm = condition.outcome
        length = f"{number(arm.means['length'][0])}" if "length" in arm.means else DASH
        rows.append(
            (
                label,
                _share(arm),
                percent_span(arm.wilson),
                percent_span(arm.nested),
                ", ".join(percent(share) for share in arm.seeds),
                length,
                percent(condition.touched),
                _data(arm.trained_on),
            )
        )
    return Table("Policies, undisturbed", headings, tuple(rows))


def _differences(results: TaskResults) -> Table:
    headings = (
        "policy",
        "against",
        "points",
        "rollouts 95 %",
        "with training 95 %",
        "p (Holm)",
        "detectable",
    )
    differences = results.policies.differences if results.policies else ()
    return Table("Differences", headings, tuple(_difference(each) for each in differences))


def _difference(each: OutcomeDifference) -> tuple[str, ...]:
    return (
        each.label,
        each.baseline,
        points(each.rollouts.estimate) + (" ●" if each.detected else ""),
        points_span(each.rollouts.interval),
        DASH if each.nested is None else points_span(each.nested),
        p_value(each.p_adjusted).removeprefix("p = ").removeprefix("p "),
        f"{100 * each.detectable:.0f} points",
    )


def _conditions(results: TaskResults) -> Table:
    headings = (
        "policy",
        "condition",
        "success",
        "rollouts 95 %",
        "rollouts with contact",
        "contacts / 100 rollouts",
    )
    rows = [*_undisturbed(results), *_rows(results, results.disturbed), *_rows(results, results.protected)]
    if not results.disturbed and not results.protected:
        rows = []
    return Table("Disturbed, protected", headings, tuple(rows))


def _undisturbed(results: TaskResults) -> Iterator[tuple[str, ...]]:
    for label, condition in results.conditions.items():
        yield (label, "undisturbed", *_numbers(condition))


def _rows(results: TaskResults, conditions: Mapping[str, Condition]) -> Iterator[tuple[str, ...]]:
    for label, condition in conditions.items():
        policy = max(
            (known for known in results.conditions if label.startswith(f"{known} ")), key=len, default=""
        )
        yield (policy or label, label.removeprefix(policy).strip() if policy else DASH, *_numbers(condition))


def _numbers(condition: Condition) -> tuple[str, ...]:
    return (
        _share(condition.outcome),
        percent_span(condition.outcome.wilson),
        percent(condition.touched),
        number(100 * condition.contacts),
    )


def _sweep(results: TaskResults) -> Table:
    headings = (
        "policy",
        "operator's noise",
        "success",
        "rollouts 95 %",
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
    return Table("Operators from perfect to clumsy", headings, tuple(rows))


def _share(arm: ArmOutcome) -> str:
    return f"{percent(arm.share)} ({arm.successes} of {arm.rollouts})"


def _data(trained_on: Mapping[str, float]) -> str:
    parts = []
    if "episodes" in trained_on:
        parts.append(f"{trained_on['episodes']:.0f} episodes")
    if "operator_time" in trained_on:
        parts.append(duration(trained_on["operator_time"]))
    return ", ".join(parts) or DASH

"""The benchmark's tables: the same on a terminal, in the report and on a Markdown page."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from handrail.collect.experiments.benchmark.format import HEADINGS, cells, difference, number
from handrail.collect.experiments.benchmark.metrics import (
    AIM,
    COST_METRICS,
    METRICS,
    SAFETY_METRICS,
    SETTLED_METRICS,
)
from handrail.collect.experiments.benchmark.published import PUBLISHED
from handrail.datasets.presentation.table import Cell, Table

_COMPARED = ("success", "final_position_error", "arm_effort", "base_path", "jerkiness", "update_ms_median")
_PAIRED = (
    "The first controller minus each other one, same goals: mean, 95 % bootstrap interval, p of Wilcoxon's"
    " signed-rank test; of success the goals that only the first (+) or only the other (−) reached, and p of"
    " McNemar's exact test. Every p is for itself, not corrected for how many there are."
)


def benchmark_tables(results: Mapping[str, Any]) -> list[Table]:
    """Return everything worth a look, profile by profile."""
    tables = [table for profile in results["profiles"] for table in profile_tables(results, profile)]
    return [*tables, all_profiles_table(results)] if len(results["profiles"]) > 1 else tables


def profile_tables(results: Mapping[str, Any], profile: str) -> list[Table]:
    """Return the tables of one profile that have something in them."""
    settled = {} if results["config"]["early_stop"] else {"at the planner's end": SETTLED_METRICS}
    groups = {"outcome": METRICS[:4], "effort": METRICS[4:], "computing": COST_METRICS, **settled}
    made = [_measures(results, group, profile, title) for title, group in groups.items()]
    made += [settling_table(results, profile)] if settled and results["config"]["closed_loop"] else []
    made.append(_safety(results, profile))
    made += [paired_table(results, _COMPARED, profile)] if results["paired"][profile] else []
    return [replace(each, title=f"{profile}: {each.title}") for each in made]


def _measures(results: Mapping[str, Any], metrics: Sequence[str], profile: str, title: str) -> Table:
    """Return measures of every controller, and the published ones where they are of the same protocol."""
    config, rows = results["config"], _rows(results["profiles"][profile], metrics)
    if profile == "nominal" and config["early_stop"] and not (config["clutter"] or config["closed_loop"]):
        known = {name: each for name, each in PUBLISHED.items() if set(metrics) & set(each)}
        rows += [[_quiet(cell) for cell in row] for row in _rows(known, metrics)]
    headings = ("controller", *(HEADINGS[metric] for metric in metrics))
    return Table(headings, rows, f"{title}, mean ± SD (min … max)")


def _rows(summaries: Mapping[str, Any], metrics: Sequence[str]) -> list[list[Cell]]:
    return [[Cell(name), *cells(summary, metrics)] for name, summary in summaries.items()]


def _quiet(cell: Cell) -> Cell:
    return replace(cell, look="quiet")


def _safety(results: Mapping[str, Any], profile: str) -> Table:
    """Return contacts, distances and brakes of every controller."""
    rows = [
        [name, f"{each['episodes_with_contact']} of {each['episodes']}", *cells(each, SAFETY_METRICS)]
        for name, each in results["profiles"][profile].items()
    ]
    headings = ("controller", "episodes with contact", *(HEADINGS[metric] for metric in SAFETY_METRICS))
    return Table(headings, rows, "safety")


def settling_table(results: Mapping[str, Any], profile: str) -> Table:
    """Return mean and worst position error when the planner ends and at the end, against the aim."""
    moments = {"planned_position_error": "the planner's last step", "final_position_error": "4 s later"}
    rows = []
    for name, summary in results["profiles"][profile].items():
        for metric, frame in moments.items():
            if metric in summary:
                ends = [f"{1e3 * summary[metric][end]:.1f}" for end in ("mean", "max")]
                missed = f"{summary['beyond_aim'][metric]} of {summary['episodes']}"
                rows.append([name, frame, *ends, missed])
    headings = ("controller", "position error at", "mean mm", "worst mm", f"beyond {1e3 * AIM:.0f} mm")
    return Table(headings, rows, "settling")


def paired_table(results: Mapping[str, Any], metrics: Sequence[str], profile: str) -> Table:
    """Return the first controller minus every other."""
    headings = (f"{next(iter(results['controllers']))} minus", *(HEADINGS[metric] for metric in metrics))
    rows = [
        [name, *(difference(metric, each[metric]) for metric in metrics)]
        for name, each in results["paired"][profile].items()
    ]
    return Table(headings, rows, "paired differences [95 % bootstrap interval]", _PAIRED)


def all_profiles_table(results: Mapping[str, Any]) -> Table:
    """Return success and jerkiness of every controller under every profile."""
    profiles = results["profiles"]
    rows = [
        [
            name,
            *(
                " / ".join(_mean(each[name], metric) for metric in ("success", "jerkiness"))
                for each in profiles.values()
            ),
        ]
        for name in results["controllers"]
    ]
    return Table(("success % / jerkiness", *profiles), rows, "success % / jerkiness by profile")


def _mean(summary: Mapping[str, Any], metric: str) -> str:
    return number(metric, summary[metric]["mean"]) if metric in summary else "–"

"""The benchmark's tables for a terminal."""

from collections.abc import Mapping
from typing import Any

from rich.console import Group

from handrail.collect.experiments.benchmark.format import (
    COMPARED,
    HEADINGS,
    Table,
    Values,
    extremes,
    main_table,
    mean_and_spread,
    paired_table,
    profile_table,
    safety_table,
    settles,
    settling_table,
)
from handrail.collect.experiments.benchmark.metrics import COST_METRICS, METRICS, SETTLED_METRICS
from handrail.datasets.presentation.plain_table import PlainTable

_SHORT = {
    HEADINGS["final_position_error"]: "d_p m",
    HEADINGS["final_orientation_error"]: "d_r",
    HEADINGS["planned_position_error"]: "d_p at the planner's end m",
    HEADINGS["planned_orientation_error"]: "d_r at the planner's end",
    HEADINGS["length"]: "steps",
    HEADINGS["arm_effort"]: "effort",
    HEADINGS["base_path"]: "base m",
    HEADINGS["wall_time_s"]: "wall s",
}


def benchmark_tables(results: Mapping[str, Any]) -> Group:
    """Return everything worth a look, for printing."""
    tables = []
    for profile in results["profiles"]:
        settled = () if results["config"]["early_stop"] else (SETTLED_METRICS,)
        for group in (METRICS[:4], METRICS[4:], COST_METRICS, *settled):
            title = f"{profile}: mean ± SD, min … max"
            tables.append(_rich(main_table(results, group, profile, _stacked), title))
        if settles(results):
            tables.append(_rich(settling_table(results, profile), f"{profile}: settling"))
        tables.append(_rich(safety_table(results, profile), f"{profile}: safety"))
        if results["paired"][profile]:
            title = f"{profile}: paired differences [95 % bootstrap interval]"
            tables.append(_rich(paired_table(results, COMPARED, profile), title))
    if len(results["profiles"]) > 1:
        tables.append(_rich(profile_table(results), "success % / jerkiness by profile"))
    return Group(*tables)


def _stacked(metric: str, values: Values) -> str:
    """Return mean and spread above the extremes: narrow enough for a terminal."""
    ends = extremes(metric, values)
    mean = mean_and_spread(metric, values)
    return mean if ends == "–" else f"{mean}\n{ends}"


def _rich(table: Table, title: str) -> PlainTable:
    headings, rows = table
    headings = [_SHORT.get(heading, heading) for heading in headings]
    return PlainTable(headings, rows, title)

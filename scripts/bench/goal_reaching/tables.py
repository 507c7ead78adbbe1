"""The benchmark's tables: the same on a terminal, in the report and on a Markdown page."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from handrail.controllers.strict_toml import read_toml
from handrail.datasets.presentation.table import Cell, Table
from handrail.scripts.bench.goal_reaching.metrics import AIM, COST, METRICS, SAFETY, SETTLED, SHOWN

_COMPARED = ("success", "final_position_error", "arm_effort", "base_path", "jerkiness", "update_ms_median")
_PAIRED = (
    "The first controller minus each other one, same goals: mean, 95 % bootstrap interval, p of Wilcoxon's"
    " signed-rank test; of success the goals that only the first (+) or only the other (−) reached, and p of"
    " McNemar's exact test. Every p is for itself, not corrected for how many there are."
)


PUBLISHED: Mapping[str, Mapping[str, Mapping[str, float]]] = {
    name: {
        metric: dict(zip(("mean", "std", "min", "max"), values, strict=False))
        for metric, values in table.items()
    }
    for name, table in read_toml(Path(__file__).with_name("published.toml"), "published figures").items()
}
"""The paper's Table I, 100 goals: controller → measure → mean, std, min, max, as far as given."""


def benchmark_tables(results: Mapping[str, Any]) -> list[Table]:
    """Return everything worth a look, profile by profile."""
    tables = [table for profile in results["profiles"] for table in profile_tables(results, profile)]
    return [*tables, _all_profiles(results)] if len(results["profiles"]) > 1 else tables


def profile_tables(results: Mapping[str, Any], profile: str) -> list[Table]:
    """Return the tables of one profile that have something in them."""
    settled = {} if results["config"]["early_stop"] else {"at the planner's end": tuple(SETTLED)}
    groups = {"outcome": METRICS[:4], "effort": METRICS[4:], "computing": tuple(COST), **settled}
    made = [_measures(results, group, profile, title) for title, group in groups.items()]
    made += [_settling(results, profile)] if settled and results["config"]["closed_loop"] else []
    made.append(_safety(results, profile))
    made += [paired_table(results, _COMPARED, profile)] if results["paired"][profile] else []
    return [replace(each, title=f"{profile}: {each.title}") for each in made]


def _table(
    first: Sequence[str], metrics: Sequence[str], rows: Sequence[Sequence[Cell | str]], title: str
) -> Table:
    return Table((*first, *(SHOWN[metric][0] for metric in metrics)), rows, title)


def _measures(results: Mapping[str, Any], metrics: Sequence[str], profile: str, title: str) -> Table:
    """Return measures of every controller, and the published ones where they are of the same protocol."""
    config, rows = results["config"], _rows(results["profiles"][profile], metrics)
    if profile == "nominal" and config["early_stop"] and not (config["clutter"] or config["closed_loop"]):
        known = {name: each for name, each in PUBLISHED.items() if set(metrics) & set(each)}
        rows += [[replace(cell, look="quiet") for cell in row] for row in _rows(known, metrics)]
    return _table(("controller",), metrics, rows, f"{title}, mean ± SD (min … max)")


def _rows(summaries: Mapping[str, Any], metrics: Sequence[str]) -> list[list[Cell]]:
    return [[Cell(name), *_cells(summary, metrics)] for name, summary in summaries.items()]


def _cells(summary: Mapping[str, Any], metrics: Sequence[str]) -> list[Cell]:
    """Return `mean ± SD`, and `min … max` below, of each measure, as far as they are known."""
    cells = []
    for metric in metrics:
        mean, spread, ends = (
            [_number(metric, summary[metric][name]) for name in names if name in summary.get(metric, {})]
            for names in (("mean",), ("std",), ("min", "max"))
        )
        spread, ends = ([], []) if metric == "success" else (spread, ends)
        cells.append(Cell(" ± ".join((*mean, *spread)) or "–", below=" … ".join(ends)))
    return cells


def _number(metric: str, value: float) -> str:
    """Return a value as it is printed; success in per cent."""
    return f"{100.0 * value if metric == 'success' else value:.{SHOWN[metric][1]}f}"


def _safety(results: Mapping[str, Any], profile: str) -> Table:
    """Return contacts, distances and brakes of every controller."""
    rows = [
        [name, f"{each['episodes_with_contact']} of {each['episodes']}", *_cells(each, tuple(SAFETY))]
        for name, each in results["profiles"][profile].items()
    ]
    return _table(("controller", "episodes with contact"), tuple(SAFETY), rows, "safety")


def _settling(results: Mapping[str, Any], profile: str) -> Table:
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
    rows = [
        [name, *(_difference(metric, each[metric]) for metric in metrics)]
        for name, each in results["paired"][profile].items()
    ]
    first = f"{next(iter(results['controllers']))} minus"
    return replace(
        _table((first,), metrics, rows, "paired differences [95 % bootstrap interval]"), caption=_PAIRED
    )


def _difference(metric: str, entry: Mapping[str, Any]) -> Cell:
    """Return a paired difference: mean, 95 % interval, p of Wilcoxon; success: counts, p of McNemar."""
    if metric == "success":
        counts = f"+{entry['only_first']} −{entry['only_second']} of {entry['pairs']}"
        return Cell(counts, below=f"p {entry['p_mcnemar']:.2g}")
    low, high = (_number(metric, bound) for bound in entry["bootstrap_interval"])
    return Cell(_number(metric, entry["mean"]), below=f"[{low}, {high}], p {entry['p_wilcoxon']:.2g}")


def _all_profiles(results: Mapping[str, Any]) -> Table:
    """Return success and jerkiness of every controller under every profile."""
    shown, profiles, rows = ("success", "jerkiness"), results["profiles"], []
    for name in results["controllers"]:
        means = (
            [cell.text.split(" ±")[0] for cell in _cells(each[name], shown)] for each in profiles.values()
        )
        rows.append([name, *map(" / ".join, means)])
    return Table(("success % / jerkiness", *profiles), rows, "success % / jerkiness by profile")

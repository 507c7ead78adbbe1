"""How the benchmark's numbers read: headings with units, cells, one set for terminal, HTML and Markdown."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from handrail.collect.experiments.benchmark.metrics import AIM, SAFETY_METRICS
from handrail.collect.experiments.benchmark.published import PUBLISHED

HEADINGS = {
    "success": "success %",
    "final_position_error": "position error m",
    "final_orientation_error": "orientation error",
    "length": "length steps",
    "arm_effort": "arm effort",
    "base_path": "base path m",
    "jerkiness": "jerkiness",
    "wall_time_s": "wall time s",
    "cpu_time_s": "CPU time s",
    "update_ms_median": "update ms",
    "updates_per_s": "updates a second",
    "planned_position_error": "position error at the planner's end m",
    "planned_orientation_error": "orientation error at the planner's end",
    "smallest_distance": "smallest distance m",
    "contacts": "steps in contact",
    "brakes": "braked updates",
}
COMPARED = ("success", "final_position_error", "arm_effort", "base_path", "jerkiness", "update_ms_median")
"""What paired tables show."""
_ONE = ("length", "arm_effort", "contacts", "brakes", "updates_per_s")
_TWO = ("base_path", "wall_time_s", "cpu_time_s", "update_ms_median")
_DIGITS: dict[str, int] = {**dict.fromkeys(_ONE, 1), **dict.fromkeys(_TWO, 2)}

Table = tuple[list[str], list[list[str]]]
"""Headings and rows."""
Values = Mapping[str, float]
"""mean, std, min, max of a measure, as far as known."""
Cell = Callable[[str, Values], str]
"""How a measure's values read."""


def number(metric: str, value: float) -> str:
    """Return a value as it is printed; success in per cent."""
    if metric == "success":
        return f"{100.0 * value:.1f}"
    if metric.startswith("planned"):
        return f"{value:.4f}"
    return f"{value:.{_DIGITS.get(metric, 3)}f}"


def mean_and_spread(metric: str, values: Values) -> str:
    """Return `mean ± SD`; of success the mean."""
    if metric == "success" or "std" not in values:
        return number(metric, values["mean"])
    return f"{number(metric, values['mean'])} ± {number(metric, values['std'])}"


def extremes(metric: str, values: Values) -> str:
    """Return `min … max`, where they are known and say something."""
    if metric == "success" or "min" not in values:
        return "–"
    return f"{number(metric, values['min'])} … {number(metric, values['max'])}"


def everything(metric: str, values: Values) -> str:
    """Return `mean ± SD (min … max)` as far as known."""
    mean = mean_and_spread(metric, values)
    ends = extremes(metric, values)
    return mean if ends == "–" else f"{mean} ({ends})"


def main_table(
    results: Mapping[str, Any], metrics: Sequence[str], profile: str, cell: Cell = everything
) -> Table:
    """Return headings and rows of the measures of every controller, and the published ones.

    Args:
        results: as summarised.
        metrics: the columns.
        profile: of the commands.
        cell: how a measure reads.
    """
    summaries, config = dict(results["profiles"][profile]), results["config"]
    if profile == "nominal" and config["early_stop"] and not (config["clutter"] or config["closed_loop"]):
        summaries |= {name: known for name, known in PUBLISHED.items() if set(metrics) & set(known)}
    rows = [[name, *_cells(summary, metrics, cell)] for name, summary in summaries.items()]
    return ["controller", *(HEADINGS[metric] for metric in metrics)], rows


def _cells(summary: Mapping[str, Any], metrics: Sequence[str], cell: Cell) -> list[str]:
    return [cell(metric, summary[metric]) if metric in summary else "–" for metric in metrics]


def profile_table(results: Mapping[str, Any]) -> Table:
    """Return success and jerkiness of every controller under every profile."""
    profiles = list(results["profiles"])
    rows = []
    for name in results["controllers"]:
        cells = [results["profiles"][profile][name] for profile in profiles]
        rows.append([name, *(f"{_mean(c, 'success')} / {_mean(c, 'jerkiness')}" for c in cells)])
    return ["success % / jerkiness", *profiles], rows


def safety_table(results: Mapping[str, Any], profile: str) -> Table:
    """Return contacts, distances and brakes of every controller."""
    rows = []
    for name, summary in results["profiles"][profile].items():
        touched = f"{summary['episodes_with_contact']} of {summary['episodes']}"
        cells = _cells(summary, SAFETY_METRICS, everything)
        rows.append([name, touched, *cells])
    return ["controller", "episodes with contact", *(HEADINGS[metric] for metric in SAFETY_METRICS)], rows


def settles(results: Mapping[str, Any]) -> bool:
    """Return whether a planner that sees the hand was given the time to bring it where it belongs."""
    return results["config"]["closed_loop"] and not results["config"]["early_stop"]


def settling_table(results: Mapping[str, Any], profile: str) -> Table:
    """Return mean and worst position error when the planner ends and at the end, against the aim."""
    moments = {"planned_position_error": "the planner's last step", "final_position_error": "4 s later"}
    rows = []
    for name, summary in results["profiles"][profile].items():
        for metric, moment in moments.items():
            if metric in summary:
                ends = [f"{1e3 * summary[metric][end]:.1f}" for end in ("mean", "max")]
                missed = f"{summary['beyond_aim'][metric]} of {summary['episodes']}"
                rows.append([name, moment, *ends, missed])
    return ["controller", "position error at", "mean mm", "worst mm", f"beyond {1e3 * AIM:.0f} mm"], rows


def paired_table(results: Mapping[str, Any], metrics: Sequence[str], profile: str) -> Table:
    """Return the first controller minus every other: mean, 95 % interval, p of Wilcoxon or McNemar."""
    headings = [f"{next(iter(results['controllers']))} minus", *(HEADINGS[metric] for metric in metrics)]
    rows = []
    for name, differences in results["paired"][profile].items():
        rows.append([name, *(_difference(metric, differences[metric]) for metric in metrics)])
    return headings, rows


def _difference(metric: str, entry: Mapping[str, Any]) -> str:
    if metric == "success":
        counts = f"+{entry['only_first']} −{entry['only_second']} of {entry['pairs']}"
        return f"{counts}, p {entry['p_mcnemar']:.2g}"
    low, high = (number(metric, bound) for bound in entry["bootstrap_interval"])
    return f"{number(metric, entry['mean'])} [{low}, {high}], p {entry['p_wilcoxon']:.2g}"


def _mean(summary: Mapping[str, Any], metric: str) -> str:
    return number(metric, summary[metric]["mean"]) if metric in summary else "–"

"""How the benchmark's numbers read: headings with units, and cells."""

from collections.abc import Mapping, Sequence
from typing import Any

from handrail.datasets.presentation.table import Cell

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
_ONE = ("length", "arm_effort", "contacts", "brakes", "updates_per_s")
_TWO = ("base_path", "wall_time_s", "cpu_time_s", "update_ms_median")
_DIGITS: dict[str, int] = {**dict.fromkeys(_ONE, 1), **dict.fromkeys(_TWO, 2)}

Values = Mapping[str, float]
"""mean, std, min, max of a measure, as far as known."""


def number(metric: str, value: float) -> str:
    """Return a value as it is printed; success in per cent."""
    if metric == "success":
        return f"{100.0 * value:.1f}"
    if metric.startswith("planned"):
        return f"{value:.4f}"
    return f"{value:.{_DIGITS.get(metric, 3)}f}"


def measured(metric: str, values: Values) -> Cell:
    """Return `mean ± SD`, and `min … max` below, as far as they are known and say something."""
    mean, spread, ends = (
        [number(metric, values[name]) for name in names if name in values]
        for names in (("mean",), ("std",), ("min", "max"))
    )
    if metric == "success":
        return Cell(*mean)
    return Cell(" ± ".join((*mean, *spread)), below=" … ".join(ends))


def cells(summary: Mapping[str, Any], metrics: Sequence[str]) -> list[Cell]:
    """Return a cell for each measure, a dash where it is not known."""
    return [measured(metric, summary[metric]) if metric in summary else Cell("–") for metric in metrics]


def difference(metric: str, entry: Mapping[str, Any]) -> Cell:
    """Return a paired difference: mean, 95 % interval, p of Wilcoxon; success: counts, p of McNemar."""
    if metric == "success":
        counts = f"+{entry['only_first']} −{entry['only_second']} of {entry['pairs']}"
        return Cell(counts, below=f"p {entry['p_mcnemar']:.2g}")
    low, high = (number(metric, bound) for bound in entry["bootstrap_interval"])
    return Cell(number(metric, entry["mean"]), below=f"[{low}, {high}], p {entry['p_wilcoxon']:.2g}")

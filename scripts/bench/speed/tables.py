"""The profile's results as tables for a terminal."""

from collections.abc import Mapping
from typing import Any

from handrail.datasets.presentation.table import Table

_PHASES = ("distances", "residuals", "solve", "rest")
_HEADINGS = ("median", "p95", "p99", "worst")


def profile_tables(results: Mapping[str, Any]) -> list[Table]:
    """Return everything measured, for printing."""
    return [_cases(results), _tasks(results), _baselines(results), _qp(results)]


def _times(measured: Mapping[str, Any]) -> list[str]:
    names = [f"{heading}_ms" for heading in _HEADINGS]
    return [f"{measured[name]:.2f}" if name in measured else "–" for name in names]


def _cases(results: Mapping[str, Any]) -> Table:
    machine = results["machine"]
    caption = f"{machine['cores']} cores, load {machine['load_before']:.1f} to {machine['load_after']:.1f}"
    cases = {name: results[name] for name in ("no_collision", "pairs_30", "pairs_100")} | results["growth"]
    counted = ("degrees_of_freedom", "horizon", "pairs", "near_mean", "rows_mean", "braked")
    rows = [
        [name, *(f"{case[count]:.0f}" for count in counted), *_times(case)] for name, case in cases.items()
    ]
    headings = ("case", "n", "N", "pairs", "near", "rows", "braked", *_HEADINGS)
    return Table(headings, rows, "Update of the masked MPC [ms]", caption)


def _tasks(results: Mapping[str, Any]) -> Table:
    rows = []
    for each in results["tasks"]:
        counts = (f"{each[name]:.0f}" for name in ("updates", "pairs", "rows_mean", "braked"))
        taken = (f"{each[clock][name]:.2f}" for clock in ("cpu", "wall") for name in ("median_ms", "p95_ms"))
        phases = (f"{each['phases_ms'][name]:.2f}" for name in _PHASES)
        rows.append([each["robot"], each["task"], *counts, *taken, *phases])
    headings = (
        "robot",
        "task",
        "updates",
        "pairs",
        "rows",
        "braked",
        "CPU median",
        "p95",
        "wall median",
        "p95",
    )
    caption = "CPU: processor time of the thread. Phases: medians on the clock"
    return Table((*headings, *_PHASES), rows, "The same while a task is done [ms]", caption)


def _baselines(results: Mapping[str, Any]) -> Table:
    rows = []
    for case, baselines in results["rivals"].items():
        for each in baselines:
            ratio = f"{each['ratio']:.4f}" if each["ratio"] else "–"
            rows.append([case, each["name"], *_times(each), ratio, str(each["solves"]), str(each["failed"])])
    headings = ("case", "baseline", *_HEADINGS, "ours / its", "solves", "failed")
    return Table(headings, rows, "Other solvers on the same problems [ms]")


def _qp(results: Mapping[str, Any]) -> Table:
    rows = []
    for name, case in results["qp"].items():
        for solver, entry in case["solvers"].items():
            broken = "–" if entry["violation"] is None else f"{entry['violation']:.0e}"
            counts = f"{entry['ratio']:.3f}", str(entry["failed"]), broken
            rows.append([name, str(case["pairs"]), solver, *_times(entry), *counts])
    headings = ("case", "pairs", "solver", *_HEADINGS, "own / it", "failed", "violation")
    return Table(headings, rows, "The same QPs by other solvers, warm-started [ms]")

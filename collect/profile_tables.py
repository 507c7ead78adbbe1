"""The profile's results as tables for a terminal."""

from typing import Any

from rich.console import Group
from rich.table import Table

_TIMES = ("median_ms", "p95_ms", "p99_ms", "worst_ms")
_RATIOS = {
    "ratio_vs_ipopt": "IPOPT converged, no collisions",
    "ratio_vs_fatrop": "FATROP converged, no collisions",
    "ratio_vs_ipopt_pairs_30": "IPOPT converged, 30 pairs",
    "ratio_vs_fatrop_pairs_30": "FATROP converged, 30 pairs",
    "ratio_vs_mink": "one step of mink, same pairs, reach",
    "ratio_vs_mink_short_reach": "the same, reach 0.05 m",
}


def profile_tables(results: dict[str, Any]) -> Group:
    """Return everything measured, for printing."""
    return Group(_cases(results), _phases(results), _rivals(results), _growth(results))


def _all(results: dict[str, Any]) -> dict[str, Any]:
    return {name: results[name] for name in ("no_collision", "pairs_30", "pairs_100")} | results["growth"]


def _cases(results: dict[str, Any]) -> Table:
    machine = results["machine"]
    table = Table(
        *("case", "n", "N", "pairs", "near", "rows", "median", "p95", "p99", "worst"),
        title="Update of the masked MPC [ms]",
        caption=f"{machine['cores']} cores, load {machine['load_before']:.1f} to {machine['load_after']:.1f}",
    )
    for name, case in _all(results).items():
        sizes = (case["degrees_of_freedom"], case["horizon"], case["pairs"])
        means = f"{case['near_mean']:.0f}", f"{case['rows_mean']:.0f}"
        table.add_row(name, *map(str, sizes), *means, *(f"{case[t]:.2f}" for t in _TIMES))
    return table


def _phases(results: dict[str, Any]) -> Table:
    cases = _all(results)
    names = list(cases["no_collision"]["phases_ms"])
    table = Table("case", *names, "braked", title="Where the time goes: medians [ms]")
    for name, case in cases.items():
        table.add_row(name, *(f"{case['phases_ms'][phase]:.2f}" for phase in names), str(case["braked"]))
    return table


def _rivals(results: dict[str, Any]) -> Table:
    table = Table("case", "rival", "median", "p95", "p99", "worst", "solves", "failed", title="Rivals [ms]")
    for case, rivals in results["rivals"].items():
        for rival in rivals:
            counts = str(rival["solves"]), str(rival["failed"])
            name = f"{rival['name']} ({rival['qp_solver']})" if "qp_solver" in rival else rival["name"]
            table.add_row(case, name, *(f"{rival[t]:.2f}" if t in rival else "" for t in _TIMES), *counts)
    return table


def _growth(results: dict[str, Any]) -> Table:
    table = Table("against", "ours / theirs", "times as fast", title="Ratios and growth")
    for key, name in _RATIOS.items():
        ratio = results[key]
        table.add_row(name, *((f"{ratio:.4f}", f"{1 / ratio:.1f}") if ratio else ("not measured", "")))
    for name, exponent in results["growth_exponents"].items():
        table.add_row(f"growth with {name}", f"size^{exponent:.2f}", "")
    return table

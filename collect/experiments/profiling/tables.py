"""The profile's results as tables for a terminal."""

from typing import Any

from rich.console import Group

from handrail.datasets.presentation.table import Table

_TIMES = ("median_ms", "p95_ms", "p99_ms", "worst_ms")
_RATIOS = {
    "ratio_vs_ipopt": "IPOPT converged, no collisions",
    "ratio_vs_ipopt_pairs_30": "IPOPT converged, 30 pairs",
    "ratio_vs_mink": "one step of mink, same pairs, reach",
    "ratio_vs_mink_short_reach": "the same, reach 0.05 m",
}


def profile_tables(results: dict[str, Any]) -> Group:
    """Return everything measured, for printing."""
    return Group(_cases(results), _phases(results), _rivals(results), _growth(results), _qp(results))


def _all(results: dict[str, Any]) -> dict[str, Any]:
    return {name: results[name] for name in ("no_collision", "pairs_30", "pairs_100")} | results["growth"]


def _cases(results: dict[str, Any]) -> Table:
    machine = results["machine"]
    headings = ("case", "n", "N", "pairs", "near", "rows", "median", "p95", "p99", "worst")
    caption = f"{machine['cores']} cores, load {machine['load_before']:.1f} to {machine['load_after']:.1f}"
    rows = []
    for name, case in _all(results).items():
        sizes = (case["degrees_of_freedom"], case["horizon"], case["pairs"])
        means = f"{case['near_mean']:.0f}", f"{case['rows_mean']:.0f}"
        rows.append((name, *map(str, sizes), *means, *(f"{case[t]:.2f}" for t in _TIMES)))
    return Table(headings, rows, "Update of the masked MPC [ms]", caption)


def _phases(results: dict[str, Any]) -> Table:
    cases = _all(results)
    names = list(cases["no_collision"]["phases_ms"])
    rows = [
        (name, *(f"{case['phases_ms'][phase]:.2f}" for phase in names), str(case["braked"]))
        for name, case in cases.items()
    ]
    return Table(("case", *names, "braked"), rows, "Where the time goes: medians [ms]")


def _rivals(results: dict[str, Any]) -> Table:
    headings, rows = ("case", "rival", "median", "p95", "p99", "worst", "solves", "failed"), []
    for case, rivals in results["rivals"].items():
        for rival in rivals:
            counts = str(rival["solves"]), str(rival["failed"])
            name = f"{rival['name']} ({rival['qp_solver']})" if "qp_solver" in rival else rival["name"]
            rows.append((case, name, *(f"{rival[t]:.2f}" if t in rival else "–" for t in _TIMES), *counts))
    return Table(headings, rows, "Rivals [ms]")


def _growth(results: dict[str, Any]) -> Table:
    rows = []
    for key, name in _RATIOS.items():
        ratio = results[key]
        rows.append((name, *((f"{ratio:.4f}", f"{1 / ratio:.1f}") if ratio else ("not measured", ""))))
    for name, exponent in results["growth_exponents"].items():
        rows.append((f"growth with {name}", f"size^{exponent:.2f}", ""))
    return Table(("against", "ours / theirs", "times as fast"), rows, "Ratios and growth")


def _qp(results: dict[str, Any]) -> Table:
    headings = ("case", "pairs", "solver", "median", "p95", "p99", "own / it", "failed", "violation")
    rows = []
    for name, case in results["qp"].items():
        for solver, entry in case["solvers"].items():
            figures = *(f"{entry[t]:.2f}" for t in _TIMES[:3]), f"{entry['ratio']:.3f}"
            broken = "–" if entry["violation"] is None else f"{entry['violation']:.0e}"
            rows.append((name, str(case["pairs"]), solver, *figures, str(entry["failed"]), broken))
    return Table(headings, rows, "The same QPs by other solvers, warm-started [ms]")

"""What the benchmark measured, as one dictionary: summaries, paired comparisons, every episode's row."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.versions import SIMULATION, versions
from handrail.datasets.statistics.paired import paired_difference, paired_success, wilson
from handrail.scripts.bench.goal_reaching.baselines import goal_reaching_settings, paper_settings
from handrail.scripts.bench.goal_reaching.catalogue import TAKE_UP, Baseline
from handrail.scripts.bench.goal_reaching.config import BenchmarkConfig
from handrail.scripts.bench.goal_reaching.metrics import AIM, METRICS, SAFETY, SETTLED, SHOWN
from handrail.scripts.bench.goal_reaching.scenes import PHYSICS

Row = Mapping[str, Any]
_COMPARED = (*(name for name in METRICS if name != "success"), "update_ms_median")
_KEPT = (*(name for name in METRICS if name != "wall_time_s"), *SAFETY, *SETTLED)
_PLACES = ("json", "report", "page")  # settings that say where results are written on a machine


def summarise(
    rows: Sequence[Row], config: BenchmarkConfig, baselines: Sequence[Baseline], skipped: Mapping[str, str]
) -> dict[str, Any]:
    """Return the results of a run.

    `controllers` holds the first profile's summaries, `profiles` every profile's; each measure has mean, std,
    min, max over its episodes. `paired` compares the first controller with every other on the same goals.

    Args:
        rows: one an episode.
        config: what was run.
        baselines: who took part.
        skipped: who did not, and why.
    """
    names, profiles = [baseline.name for baseline in baselines], config.profile_names
    cells = {profile: {name: rows_of(rows, profile, name) for name in names} for profile in profiles}
    summaries = {
        profile: {name: _summary(own) for name, own in by_name.items()} for profile, by_name in cells.items()
    }
    return {
        "controllers": summaries[profiles[0]],
        "profiles": summaries,
        "paired": {profile: _paired(cells[profile], config.seed) for profile in profiles},
        "titles": {baseline.name: baseline.help for baseline in baselines},
        "skipped": dict(skipped),
        "config": {name: value for name, value in asdict(config).items() if name not in _PLACES},
        "mpc_settings": asdict(goal_reaching_settings()) | {"take_up": TAKE_UP},
        "mpc_paper_settings": asdict(paper_settings()),
        "physics": dict(PHYSICS) if config.physics else {},
        "machine": {"cores": os.cpu_count(), "load": os.getloadavg()[0]},
        "versions": versions(*SIMULATION, "scipy"),
        "episodes": [dict(row) for row in rows],
    }


def measures_by_goal(results: Mapping[str, Any]) -> dict[str, Any]:
    """Return what every episode gave: profile → controller → measure → a value a goal, in their order.

    Times are left out: no other run has the same ones.

    Args:
        results: as summarised.
    """
    rows = results["episodes"]
    return {
        profile: {
            name: {metric: [row[metric] for row in rows_of(rows, profile, name)] for metric in _KEPT}
            for name in summaries
        }
        for profile, summaries in results["profiles"].items()
    }


def rows_of(rows: Sequence[Row], profile: str, name: str) -> list[Row]:
    """Return the rows of a controller under a profile, by goal."""
    own = [row for row in rows if row["profile"] == profile and row["controller"] == name]
    return sorted(own, key=lambda row: row["goal"])


def column(rows: Sequence[Row], metric: str, known: bool = False) -> FloatArray:
    """Return a measure of every row, NaN where it has none; or only those that are known."""
    values = np.array([np.nan if row[metric] is None else float(row[metric]) for row in rows])
    return values[np.isfinite(values)] if known else values


def _summary(rows: Sequence[Row]) -> dict[str, Any]:
    summary: dict[str, Any] = {"episodes": len(rows)}
    for metric in SHOWN:
        values = column(rows, metric, known=True)
        if len(values):
            summary[metric] = {
                "mean": float(values.mean()),
                "std": float(values.std(ddof=1)) if len(values) > 1 else 0.0,
                "min": float(values.min()),
                "max": float(values.max()),
            }
    successes = sum(row["success"] for row in rows)
    summary["success"]["interval"] = list(wilson(successes, len(rows)))
    summary["episodes_with_contact"] = sum(row["contacts"] > 0 for row in rows)
    errors = "planned_position_error", "final_position_error"
    summary["beyond_aim"] = {name: int(np.sum(column(rows, name) > AIM)) for name in errors}
    return summary


def _paired(cells: Mapping[str, Sequence[Row]], seed: int) -> dict[str, Any]:
    """Return the first controller against every other, first minus other."""
    rng = np.random.default_rng([seed, 99])
    (_, first), *others = cells.items()
    found: dict[str, Any] = {}
    for name, other in others if len(first) > 1 else ():
        success = paired_success(column(first, "success"), column(other, "success"))
        found[name] = {"success": asdict(success)}
        for metric in _COMPARED:
            difference = paired_difference(column(first, metric), column(other, metric), rng)
            found[name][metric] = asdict(difference)
    return found

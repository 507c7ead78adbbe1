"""The benchmark's measures: of an episode, as the protocol has them; of all, summarised and paired."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from handrail.collect.world.tasks.goal_reaching import STEP, reached
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.command import Diagnostics
from handrail.controllers.versions import SIMULATION, versions
from handrail.datasets.quality.metrics import path_length
from handrail.datasets.statistics.paired import paired_difference, paired_success, wilson
from handrail.scripts.bench.goal_reaching.baselines import goal_reaching_settings, paper_settings
from handrail.scripts.bench.goal_reaching.config import TAKE_UP, Baseline, BenchmarkConfig
from handrail.scripts.bench.goal_reaching.scenes import PHYSICS

TABLE_I = {
    "success": ("success %", 1),
    "final_position_error": ("position error m", 3),
    "final_orientation_error": ("orientation error", 3),
    "length": ("length steps", 1),
    "arm_effort": ("arm effort", 1),
    "base_path": ("base path m", 2),
    "jerkiness": ("jerkiness", 3),
    "wall_time_s": ("wall time s", 2),
}
"""Those of the paper's Table I, in its order: name → heading with its unit, digits that are shown."""
COST = {
    "cpu_time_s": ("CPU time s", 2),
    "update_ms_median": ("update ms", 2),
    "updates_per_s": ("updates a second", 1),
}
"""The cost of a controller: of an episode, of an update (median of the episode's), updates a second of it."""
SAFETY = {
    "contacts": ("steps in contact", 1),
    "smallest_distance": ("smallest distance m", 3),
    "brakes": ("braked updates", 1),
}
SETTLED = {
    "planned_position_error": ("position error at the planner's end m", 4),
    "planned_orientation_error": ("orientation error at the planner's end", 4),
}
"""Errors right after the planner's last step; only of episodes that got there."""
METRICS = tuple(TABLE_I)
SHOWN = {**TABLE_I, **COST, **SAFETY, **SETTLED}
AIM = 0.01  # position error within which a planner that sees the hand was to bring it [m]


@dataclass(frozen=True)
class Trace:
    """The trace of an episode of T steps."""

    q: FloatArray  # positions before the first and after every step, (T + 1, n)
    v: FloatArray  # the simulated joint velocities after every step, (T, n)
    errors: FloatArray  # (d_p [m], d_r) after every step, (T, 2)
    hand: FloatArray  # the tool's positions before the first and after every step [m], (T + 1, 3)
    contacts: Sequence[tuple[str, ...]]  # names of the forbidden contacts of every step, T tuples
    updates: Sequence[Diagnostics]  # of the controller
    end: int  # first step from which on nothing but rest arrives from the planner
    wall_time: float  # of the episode, controller, physics and collision checking together [s]
    cpu_time: float  # of the process in that time [s]; other programs do not lengthen it


def measure(trace: Trace, collision: CollisionModel, base: int) -> dict[str, Any]:
    """Return the row of an episode.

    Args:
        trace: what happened.
        collision: the pairs whose distance is looked at, contacts or not.
        base: number of base coordinates, which come first.
    """
    d_p, d_r = trace.errors[-1].tolist()
    names = sorted({name for step in trace.contacts for name in step})
    came = 0 < trace.end <= len(trace.errors)
    planned = trace.errors[trace.end - 1].tolist() if came else (None, None)
    return {
        "success": reached(d_p, d_r),
        "final_position_error": d_p,
        "final_orientation_error": d_r,
        "length": len(trace.v),
        "arm_effort": arm_effort(trace.v[:, base:]),
        "base_path": path_length(trace.q[:, :2]) if base else 0.0,
        "jerkiness": jerkiness(trace.v),
        "wall_time_s": trace.wall_time,
        "cpu_time_s": trace.cpu_time,
        "contacts": sum(map(bool, trace.contacts)),
        "contact_names": names,
        "smallest_distance": float(collision.values(trace.q).min(initial=np.inf)),
        "brakes": sum(update.status.brakes for update in trace.updates),
        "updates": len(trace.updates),
        "update_ms_median": 1e3 * float(np.median([update.solve_time for update in trace.updates])),
        "updates_per_s": len(trace.updates) / (len(trace.v) * STEP),
        **dict(zip(SETTLED, planned, strict=True)),
    }


def arm_effort(velocities: FloatArray) -> float:
    """Return the arm control effort `Σ_t ‖q̇_arm‖²` (without a time step), of (T, arm) [rad²/s²]."""
    return float(np.sum(velocities**2))


def jerkiness(velocities: FloatArray) -> float:
    """Return the full-command jerkiness `mean_t ‖q̇_{t+1} − q̇_t‖ / h`, of (T, n); a mean acceleration.

    NaN where there are fewer than two samples.
    """
    changes = np.linalg.norm(np.diff(velocities, axis=0), axis=1)
    return float(changes.mean() / STEP) if len(changes) else float("nan")


Row = Mapping[str, Any]
_COMPARED = (*(name for name in METRICS if name != "success"), "update_ms_median")
KEPT = (*(name for name in METRICS if name != "wall_time_s"), *SAFETY, *SETTLED)
_PLACES = ("json", "page")  # settings that say where results are written on a machine


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
        profile: {name: summary(own) for name, own in by_name.items()} for profile, by_name in cells.items()
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
            name: {metric: [row[metric] for row in rows_of(rows, profile, name)] for metric in KEPT}
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


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Return mean, std, min and max of every measure over its episodes, and what is counted."""
    found: dict[str, Any] = {"episodes": len(rows)}
    for metric in SHOWN:
        values = column(rows, metric, known=True)
        if len(values):
            found[metric] = {
                "mean": float(values.mean()),
                "std": float(values.std(ddof=1)) if len(values) > 1 else 0.0,
                "min": float(values.min()),
                "max": float(values.max()),
            }
    successes = sum(row["success"] for row in rows)
    found["success"]["interval"] = list(wilson(successes, len(rows)))
    found["episodes_with_contact"] = sum(row["contacts"] > 0 for row in rows)
    errors = "planned_position_error", "final_position_error"
    found["beyond_aim"] = {name: int(np.sum(column(rows, name) > AIM)) for name in errors}
    return found


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

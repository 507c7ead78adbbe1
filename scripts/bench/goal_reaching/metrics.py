"""The benchmark's measures of an episode, from the simulated joint velocities, as the protocol has them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handrail.collect.world.tasks.goal_reaching import STEP, reached
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.command import Diagnostics
from handrail.datasets.quality.metrics import path_length

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
"""What a controller costs: of an episode, of an update (median of the episode's), updates a second of it."""
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
    """What happened in an episode of T steps."""

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

"""What a case's run amounts to, in numbers."""

from typing import Any

import numpy as np

from handrail.collect.experiments.showcase.run import Trace
from handrail.controllers.arrays import FloatArray


def summary(trace: Trace) -> dict[str, Any]:
    """Return the figures of a run, ready for JSON; lengths in [m], speeds in [m/s] and [rad/s].

    `tracking` is ‖realised - asked‖ over the commanded channels at every moment from the start on; `share` is
    its mean over the cruising speed.
    """
    error, smallest = tracking_error(trace), trace.distances.min(axis=0)
    cruise = float(np.linalg.norm(trace.asked, axis=1).max())
    result = {
        "case": trace.case.name,
        "title": trace.case.title,
        "channels": list(trace.case.channels),
        "seconds": trace.outcome.seconds,
        "frames": trace.outcome.frames,
        "contacts": trace.outcome.contacts,
        "brakes": trace.outcome.brakes,
        "tracking": {
            "mean": float(error.mean()),
            "max": float(error.max()),
            "cruising_speed": cruise,
            "share": float(error.mean() / cruise) if cruise else 0.0,
        },
        "smallest_distance": _closest(trace, smallest, np.ones(len(smallest), dtype=bool)),
        "smallest_distance_at_full_margin": _closest(trace, smallest, ~trace.own_margin),
        "solve_time_ms": _percentiles(1e3 * trace.solve_times),
    }
    if trace.case.held:
        held = held_error(trace)
        result["hold"] = {"mean": float(held.mean()), "max": float(held.max())}
    return result


def tracking_error(trace: Trace) -> FloatArray:
    """Return ‖realised - asked‖ over the commanded channels, (T,)."""
    return np.linalg.norm(trace.realised - trace.asked, axis=1)


def held_error(trace: Trace) -> FloatArray:
    """Return how far the hand is from the held point, (T,) [m]."""
    return np.linalg.norm(trace.hand - np.array(trace.case.held), axis=1)


def _closest(trace: Trace, smallest: FloatArray, which: np.ndarray) -> dict[str, Any]:
    index = int(np.flatnonzero(which)[np.argmin(smallest[which])])
    return {"value": float(smallest[index]), "pair": list(trace.pairs[index])}


def _percentiles(values: FloatArray) -> dict[str, float]:
    p50, p95, p99 = np.percentile(values, [50, 95, 99])
    return {"median": float(p50), "p95": float(p95), "p99": float(p99), "worst": float(values.max())}

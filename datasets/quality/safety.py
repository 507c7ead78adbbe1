"""How close an episode came to harm, from what was recorded of distances, contacts and slack."""

import numpy as np
from numpy.typing import ArrayLike

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.missing import DoesNotApply

_ROUNDING = 1e-6


def smallest_distance(distance: FloatArray) -> float:
    """Return min_t d(t), signed: negative is penetration [m].

    Args:
        distance: `(N,)` [m]; what is not finite is no measurement.
    """
    return float(_finite(distance).min())


def time_within(distance: FloatArray, margin: float, fps: float) -> float:
    """Return ∫ 1[d(t) < margin] dt: for how long something was nearer than the margin [s].

    Args:
        distance: `(N,)` [m].
        margin: [m].
        fps: Frames a second [Hz].
    """
    return float(np.count_nonzero(_finite(distance) < margin)) / fps


def contacts_begun(contacts: ArrayLike) -> float:
    """Return how many contacts began, their onsets: the sum of all rises of their number.

    Args:
        contacts: How many there were in each period, `(N,)`.
    """
    return float(np.maximum(np.diff(np.asarray(contacts, np.float64), prepend=0.0), 0.0).sum())


def impulse(impulses: FloatArray) -> float:
    """Return the impulse of all contacts, Σ_t ∫ ‖F‖ dt [N s].

    Args:
        impulses: Of each period, `(N,)` [N s].
    """
    return float(_finite(impulses).sum())


def slack_used(slack: FloatArray) -> float:
    """Return max_t of the slack: how far a soft limit was given up at most, in the limit's unit.

    Below 1e-6 it is the solver's rounding, and zero.

    Args:
        slack: Largest violation in the plan of each period, `(N,)`.
    """
    most = float(_finite(slack).max())
    return most if most > _ROUNDING else 0.0


def _finite(values: FloatArray) -> FloatArray:
    known = values[np.isfinite(values)]
    if not known.size:
        raise DoesNotApply("no number in the column is finite")
    return known

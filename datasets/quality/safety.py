"""How close an episode came to harm, from what was recorded of distances, contacts and slack."""

import numpy as np
from numpy.typing import ArrayLike

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.metric import metric
from handrail.datasets.quality.pool import ObservationPool
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply

_ROUNDING = 1e-6  # of the solver: below it, slack is zero


def contacts_begun(contacts: ArrayLike) -> float:
    """Return how many contacts began, their onsets: the sum of all rises of their number.

    Args:
        contacts: How many there were in each period, `(N,)`.
    """
    return float(np.maximum(np.diff(np.asarray(contacts, np.float64), prepend=0.0), 0.0).sum())


@metric("smallest_distance", "m", "higher", "smallest signed distance to a collision")
def smallest_distance(episode: Demonstration, pool: ObservationPool) -> float:
    """Return min_t d(t), signed: negative is penetration [m]."""
    return float(_finite(episode, "distance").min())


@metric("contacts", "", "lower", "unwanted contacts that began")
def contacts(episode: Demonstration, pool: ObservationPool) -> float:
    """Return how many there were, see `contacts_begun`."""
    return contacts_begun(episode.numbers("contacts")[:, 0])


@metric("impulse", "N s", "lower", "impulse of all unwanted contacts", title="contact impulse")
def impulse(episode: Demonstration, pool: ObservationPool) -> float:
    """Return Σ_t ∫ ‖F‖ dt [N s]."""
    return float(_finite(episode, "impulse").sum())


@metric(
    "time_within_margin",
    "s",
    "lower",
    "for how long something was nearer than the margin",
    title="time within the margin",
)
def time_within_margin(episode: Demonstration, pool: ObservationPool) -> float:
    """Return ∫ 1[d(t) < margin] dt [s]."""
    return float(np.count_nonzero(_finite(episode, "distance") < pool.margin)) / episode.fps


@metric("slack_used", "unit of the limit", "lower", "how far a soft limit was given up at most", "controller")
def slack_used(episode: Demonstration, pool: ObservationPool) -> float:
    """Return max_t of the largest violation in the plan, in the limit's unit."""
    most = float(_finite(episode, "slack").max())
    return most if most > _ROUNDING else 0.0


def _finite(episode: Demonstration, part: str) -> FloatArray:
    """Return the measurements in a column; what is not finite is none."""
    values = episode.numbers(part)[:, 0]
    known = values[np.isfinite(values)]
    if not known.size:
        raise DoesNotApply("no number in the column is finite")
    return known

"""How close an episode came to harm, from what was recorded of distances, contacts and slack."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.metric import metric
from handrail.datasets.quality.scale import Scale
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply

_ROUNDING = 1e-6  # of the solver: below it, slack is zero


@metric("m", "higher")
def smallest_distance(episode: Demonstration, scale: Scale) -> float:
    """Smallest signed distance to a collision.

    min_t d(t); negative is penetration [m].
    """
    return float(_finite(episode, "distance").min())


@metric("", "lower")
def contacts(episode: Demonstration, scale: Scale) -> float:
    """Unwanted contacts that began.

    The sum of all rises of their number.
    """
    return float(np.maximum(np.diff(_finite(episode, "contacts"), prepend=0.0), 0.0).sum())


@metric("N s", "lower", title="contact impulse")
def impulse(episode: Demonstration, scale: Scale) -> float:
    """Impulse of all unwanted contacts.

    Σ_t ∫ ‖F‖ dt [N s].
    """
    return float(_finite(episode, "impulse").sum())


@metric("s", "lower", title="time within the margin")
def time_within_margin(episode: Demonstration, scale: Scale) -> float:
    """For how long something was nearer than the margin.

    ∫ 1[d(t) < margin] dt [s].
    """
    return float(np.count_nonzero(_finite(episode, "distance") < scale.margin)) / episode.fps


@metric("unit of the limit", "lower", "controller")
def slack_used(episode: Demonstration, scale: Scale) -> float:
    """How far a soft limit was given up at most.

    max_t of the largest violation in the plan, in the limit's unit.
    """
    most = float(_finite(episode, "slack").max())
    return most if most > _ROUNDING else 0.0


def _finite(episode: Demonstration, part: str) -> FloatArray:
    """Return the measurements in a column; what is not finite is none."""
    values = episode.numbers(part)[:, 0]
    known = values[np.isfinite(values)]
    if not known.size:
        raise DoesNotApply("no number in the column is finite")
    return known

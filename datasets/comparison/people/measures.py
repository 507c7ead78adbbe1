"""What is compared of people who drive: how it went, how safe it was, what it cost them."""

import math

from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.metric import metric
from handrail.datasets.quality.pool import ObservationPool
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply

_CHOSEN = (
    "contacts",
    "smallest_distance",
    "mode_switches",
    "input_reversals",
    "idle_raw",
    "input_idle",
    "undos",
    "input_age",
    "round_trip",
)


@metric("success", "", "higher", "share of the episodes that succeeded")
def success(episode: Demonstration, pool: ObservationPool) -> float:
    """Return 1 for an episode that succeeded, else 0."""
    if episode.success is None:
        raise DoesNotApply("success was not recorded")
    return float(episode.success)


@metric("completion_time", "s", "lower", "how long the episodes that succeeded took")
def completion_time(episode: Demonstration, pool: ObservationPool) -> float:
    """Return how long it took [s]; failures have none."""
    if not episode.success:
        raise DoesNotApply("it did not succeed")
    return episode.seconds


MEASURES = (success, completion_time, *(each for each in METRICS if each.name in _CHOSEN))
SHARES = frozenset({"success", "idle_raw", "input_idle"})


def known(value: float) -> bool:
    """Return whether a number is one."""
    return math.isfinite(value)

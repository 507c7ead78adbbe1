"""What only the device of a person tells: how old its input was when it counted, and what was taken back."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.metric import metric
from handrail.datasets.quality.pool import ObservationPool
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply

_LATE = 95.0  # percentile


@metric("undos", "", "lower", "how often the operator went back to a checkpoint")
def undos(episode: Demonstration, pool: ObservationPool) -> float:
    """Return how often they did in an episode that was kept."""
    return float(_of_person(episode, "undos").max())


@metric(
    "input_age",
    "s",
    "lower",
    "age of the input when it became a command, 95th percentile",
    title="age of the input",
)
def input_age(episode: Demonstration, pool: ObservationPool) -> float:
    """Return the 95th percentile of `teleop.age` over the frames [s]."""
    return float(np.percentile(_of_person(episode, "age"), _LATE))


@metric(
    "round_trip",
    "s",
    "lower",
    "from the picture to the answer to it, 95th percentile",
    title="round trip",
)
def round_trip(episode: Demonstration, pool: ObservationPool) -> float:
    """Return the 95th percentile of `teleop.round_trip` over the frames that have one [s]."""
    known = _of_person(episode, "round_trip")
    known = known[known > 0.0]
    if not known.size:
        raise DoesNotApply("the device shows nothing that could be answered")
    return float(np.percentile(known, _LATE))


def _of_person(episode: Demonstration, part: str) -> FloatArray:
    if not (episode.column("device") != "").any():
        raise DoesNotApply("nobody held a device: a script or a policy steered")
    return episode.matrix(part)[:, 0]

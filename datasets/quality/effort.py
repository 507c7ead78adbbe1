"""How much work steering was: what the operator put in, by axis, and what only a person's device records.

Inputs of different kinds are made comparable by their scale, the largest value of each axis in all datasets
that are compared: 1 is full deflection; an axis that was never used does not count. Measures: Herlant et al.
2016, "Assistive teleoperation of robot arms via automatic time-optimal mode switching", for mode switches;
the others are common in teleoperation.
"""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.metric import metric
from handrail.datasets.quality.pool import ObservationPool
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply

_LATE = 95.0  # percentile
DEAD_BAND = 0.05  # of full deflection: below it an axis is not in use


@metric("input_effort", "s", "lower", "seconds of full deflection, input axes added up", "pool")
def input_effort(episode: Demonstration, pool: ObservationPool) -> float:
    """Return Σ_i ∫ |u_i| / scale_i dt [s]."""
    return float(np.abs(_deflection(episode, pool)).sum()) / episode.fps


@metric("input_reversals", "", "lower", "how often an input axis changed its sign", "pool")
def input_reversals(episode: Demonstration, pool: ObservationPool) -> float:
    """Return how often an axis changed its sign, axes added up; what is below 5 % of full is passed over."""
    deflection = _deflection(episode, pool)
    signs = np.where(np.abs(deflection) >= DEAD_BAND, np.sign(deflection), 0.0)
    return float(sum(np.count_nonzero(np.diff(axis[axis != 0])) for axis in signs.T))


@metric(
    "mode_switches", "", "lower", "how often the mode, or the set of axes that the operator owned, changed"
)
def mode_switches(episode: Demonstration, pool: ObservationPool) -> float:
    """Return how often either changed; one of them is enough."""
    changed = [_changes(episode.column(part)) for part in ("mode", "owned") if episode.has(part)]
    if not changed:
        raise DoesNotApply("no column of the mode or of the axes that the operator owned")
    return float(np.count_nonzero(np.any(changed, axis=0)))


@metric(
    "active_axes",
    "",
    "lower",
    "mean number of input axes in use at a time",
    "pool",
    title="active input axes",
)
def active_axes(episode: Demonstration, pool: ObservationPool) -> float:
    """Return the mean number of axes that are above 5 % of full deflection at a time."""
    return float((np.abs(_deflection(episode, pool)) >= DEAD_BAND).sum(axis=1).mean())


@metric(
    "input_idle", "", "lower", "share of time with no input axis in use", "pool", title="hands off the input"
)
def input_idle(episode: Demonstration, pool: ObservationPool) -> float:
    """Return the share of frames in which no axis is above 5 % of full deflection, 0 to 1."""
    return float((np.abs(_deflection(episode, pool)) < DEAD_BAND).all(axis=1).mean())


def _changes(values: np.ndarray) -> np.ndarray:
    rows = values.reshape(len(values), -1)
    return (rows[1:] != rows[:-1]).any(axis=1)


def _deflection(episode: Demonstration, pool: ObservationPool) -> FloatArray:
    used = pool.input_scale > 0
    if not used.any():
        raise DoesNotApply("no input axis was ever used")
    return episode.inputs[:, used] / pool.input_scale[used]


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

"""How much work steering was: what the operator put in, by axis, and what only a person's device records.

The input is the velocity that the operator asked for on each axis, beside a policy on those that they own;
where both own one, it is their mean. A hand's axes are the world's, whatever axes a person steers along: with
a tool that turns, the axis changes. The scale is the largest value of each axis in all datasets that are
compared: 1 is full deflection; an axis that was never used does not count.
Measures: Herlant et al. 2016, "Assistive teleoperation of robot arms via automatic time-optimal mode
switching", for mode switches; the others are common in teleoperation.
"""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.metric import metric
from handrail.datasets.quality.scale import Scale
from handrail.datasets.reading import naming
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply

_LATE = 95.0  # percentile
DEAD_BAND = 0.05  # of full deflection: below it an axis is not in use


@metric("s", "lower", "scale")
def input_effort(episode: Demonstration, scale: Scale) -> float:
    """Seconds of full deflection, input axes added up.

    Σ_i ∫ |u_i| / scale_i dt [s].
    """
    return float(np.abs(_deflection(episode, scale)).sum()) / episode.fps


@metric("", "lower", "scale")
def input_reversals(episode: Demonstration, scale: Scale) -> float:
    """How often an input axis changed its sign.

    Axes added up; what is below 5 % of full deflection is passed over.
    """
    deflection = _deflection(episode, scale)
    signs = np.where(np.abs(deflection) >= DEAD_BAND, np.sign(deflection), 0.0)
    return float(sum(np.count_nonzero(np.diff(axis[axis != 0])) for axis in signs.T))


@metric("", "lower")
def mode_switches(episode: Demonstration, scale: Scale) -> float:
    """How often the mode, or the set of axes that the operator owned, changed; pauses are passed over."""
    parts, steers = [episode.column(part) for part in ("mode",) if episode.has(part)], slice(None)
    by, least = ("owner", 2) if episode.has("owner") else ("owned", 1)  # 1 beside a policy is the policy
    if episode.has(by):
        own = np.delete(episode.matrix(by) >= least, naming.gripper_entries(episode.entries(by)), axis=1)
        parts, steers = [*parts, own], own.any(axis=1)
    if not parts:
        raise DoesNotApply("no column of the mode or of the axes that the operator owned")
    rows = [part.reshape(len(part), -1)[steers] for part in parts]
    changed = [(each[1:] != each[:-1]).any(axis=1) for each in rows]
    return float(np.count_nonzero(np.any(changed, axis=0)))


@metric("", "lower", "scale", "active input axes")
def active_axes(episode: Demonstration, scale: Scale) -> float:
    """Mean number of input axes in use at a time."""
    return float((np.abs(_deflection(episode, scale)) >= DEAD_BAND).sum(axis=1).mean())


@metric("", "lower", "scale", "hands off the input")
def input_idle(episode: Demonstration, scale: Scale) -> float:
    """Share of time with no input axis in use."""
    return float((np.abs(_deflection(episode, scale)) < DEAD_BAND).all(axis=1).mean())


def _deflection(episode: Demonstration, scale: Scale) -> FloatArray:
    used = scale.input_scale > 0
    if not used.any():
        raise DoesNotApply("no input axis was ever used")
    return episode.inputs[:, used] / scale.input_scale[used]


@metric("", "lower")
def undos(episode: Demonstration, scale: Scale) -> float:
    """How often the operator went back to where they went on last."""
    return float(_of_person(episode, "undos").max())


@metric("s", "lower", title="age of the input")
def input_age(episode: Demonstration, scale: Scale) -> float:
    """Age of the input when it became a command, 95th percentile."""
    return float(np.percentile(_of_person(episode, "age"), _LATE))


@metric("s", "lower")
def round_trip(episode: Demonstration, scale: Scale) -> float:
    """From the picture to the answer to it, 95th percentile.

    Of the frames that have one.
    """
    known = _of_person(episode, "round_trip")
    known = known[known > 0.0]
    if not known.size:
        raise DoesNotApply("the device shows nothing that could be answered")
    return float(np.percentile(known, _LATE))


def _of_person(episode: Demonstration, part: str) -> FloatArray:
    if not (episode.column("device") != "").any():
        raise DoesNotApply("nobody held a device: a script or a policy steered")
    return episode.matrix(part)[:, 0]

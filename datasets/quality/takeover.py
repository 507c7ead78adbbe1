"""How often a person took over from a policy, for how long, and what: of datasets that say who owned what.

An intervention is a stretch of frames in which the person owned something; it ends where they hand back, or
with the episode.
"""

import numpy as np

from handrail.controllers.arrays import BoolArray, IntArray
from handrail.datasets.quality.metric import metric
from handrail.datasets.quality.scale import Scale
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply
from handrail.datasets.recording.frames import BY_PERSON

_MINUTE = 60.0


@metric("", "lower")
def interventions(episode: Demonstration, scale: Scale) -> float:
    """How often the person took over from the policy."""
    return float(len(_lengths(episode)))


@metric("1/min", "lower", title="interventions a minute")
def intervention_rate(episode: Demonstration, scale: Scale) -> float:
    """How often the person took over, a minute of the episode."""
    return len(_lengths(episode)) * _MINUTE / episode.seconds


@metric("s", "lower", title="time until the hand-back")
def intervention_length(episode: Demonstration, scale: Scale) -> float:
    """Mean time from a take-over to the hand-back, or to the end of the episode."""
    lengths = _lengths(episode)
    if not lengths.size:
        raise DoesNotApply("nobody took over")
    return float(lengths.mean()) / episode.fps


@metric("", "lower", title="share of interventions")
def intervention_share(episode: Demonstration, scale: Scale) -> float:
    """Share of the frames in which the person owned something."""
    return float(_taken(episode).mean())


@metric(title="base taken over")
def base_taken(episode: Demonstration, scale: Scale) -> float:
    """Share of the frames in which the person took over the base."""
    return _share(episode, "base")


@metric(title="hand taken over")
def hand_taken(episode: Demonstration, scale: Scale) -> float:
    """Share of the frames in which the person took over a hand, the pair or a gripper."""
    return _share(episode, "hand")


@metric(title="joints taken over")
def joints_taken(episode: Demonstration, scale: Scale) -> float:
    """Share of the frames in which the person took over single joints."""
    return _share(episode, "joint")


TAKE_OVER = (
    *(interventions, intervention_rate, intervention_length, intervention_share),
    *(base_taken, hand_taken, joints_taken),
)


def _taken(episode: Demonstration) -> BoolArray:
    """Return in which frames the person owned something, (N,)."""
    return episode.numbers("intervention")[:, 0] > 0.0


def _lengths(episode: Demonstration) -> IntArray:
    """Return the lengths of the interventions [frames]."""
    edges = np.diff(_taken(episode).astype(int), prepend=0, append=0)
    return np.flatnonzero(edges < 0) - np.flatnonzero(edges > 0)


def _share(episode: Demonstration, group: str) -> float:
    """Return the share of the frames in which the person took over a channel of base, hand or joint."""
    owners, names = episode.numbers("owner"), episode.entries("owner")
    if not names:
        raise DoesNotApply("the entries of the owners have no names")
    kinds = [kind if kind in ("base", "joint") else "hand" for kind in (each.split(".")[0] for each in names)]
    mine = owners[:, np.equal(kinds, group)] >= BY_PERSON
    return float((mine.any(axis=1) & _taken(episode)).mean())

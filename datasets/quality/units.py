"""Whether numbers of two groups are in the same unit, as far as their datasets tell; if nobody knows, no.

LeRobot's format names no units. Evidence: that it is one dataset; that Handrail recorded both (metres,
radians, seconds); else the same robot, the same names that say what they measure, the same rate and numbers
of the same size, all of these.
"""

from collections.abc import Sequence

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.episode_set import EpisodeSet
from handrail.datasets.quality.metric import Needs
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply
from handrail.datasets.reading.naming import quantity

_FACTOR = 10.0  # ranges that differ by more are of other units: degrees are 57 times radians
_PERCENT = (1.0, 99.0)
_STILL = 1e-9
_NAMED = 3  # names that are shown
_PARTS = ("state", "action", "asked")
# controllers give up limits of their own, in [m], [m/s] or a share
_OTHER_MODES = "the modes differ, so the controllers and their soft limits may"


def why_not(needs: Needs, one: EpisodeSet, other: EpisodeSet) -> str:
    """Return why a metric's values of two groups cannot be compared; "" if they can.

    `needs` is what its unit hangs on: nothing; what moves; of a jerk the frame rate as well; the unit of what
    moves; what the action commands; whose soft limits were given up (the groups must have been read); or
    everything on one scale.
    """
    if needs == "controller":
        return "" if one.modes == other.modes else _OTHER_MODES
    if not needs or one.episodes[0].info.root == other.episodes[0].info.root:
        return ""
    try:
        if needs == "scale":
            return _on_one_scale(one, other)
        if needs == "action":
            return _numbers("action", one, other) or _followed(one, other)
        if needs == "jerk" and one.first.fps != other.first.fps:
            return "the frame rates differ, and jerk grows with them"
        tools = one.first.motion_is_tool and other.first.motion_is_tool
        if tools and (needs != "position" or _by_handrail(one.first, other.first)):
            return ""  # the same thing moves; a measure without a unit needs no more
        return _numbers("state", one, other)
    except DoesNotApply as error:
        return str(error)


def _on_one_scale(one: EpisodeSet, other: EpisodeSet) -> str:
    if _columns(one.first) != _columns(other.first):
        return "the datasets have different columns, so there is no common scale"
    parts = [part for part in _PARTS if one.first.has(part)]
    return next(filter(None, (_numbers(part, one, other) for part in parts)), "")


def _columns(episode: Demonstration) -> tuple[object, ...]:
    """Return sizes and entries of what is measured."""
    choices = (*episode.columns.choices("action"), *episode.columns.choices("asked"))
    names = sorted(name for name in episode.frames if name.startswith("observation") or name in choices)
    return tuple((name, episode.frames[name].shape[1:], episode.info.features[name].names) for name in names)


def _numbers(part: str, one: EpisodeSet, other: EpisodeSet) -> str:
    """Return why the numbers of a part are not known to be in the same unit."""
    first, second = one.first, other.first
    names = first.entries(part), second.entries(part)
    if not all(names):
        return f"the entries of the {part} have no names, so their units are not known"
    if names[0] != names[1]:
        return f"they have other entries in the {part} ({_few(names[0])}; {_few(names[1])})"
    if _by_handrail(first, second):
        return ""
    robots = first.info.robot_type, second.info.robot_type
    if not robots[0] or robots[0] != robots[1]:
        told = " and ".join(robot or "not recorded" for robot in robots)
        return f"the robots are not known to be the same ({told}), so the units of the {part} are not either"
    if first.fps != second.fps:
        return f"the frame rates differ, and the {part} may be in units a frame"
    silent = tuple(name for name in names[0] if not quantity(name))
    if silent:
        return f"the names in the {part} ({_few(silent)}) do not say whether it is positions or velocities"
    factor = _times(one.rows(part), other.rows(part))
    if factor > _FACTOR:
        return f"the numbers of the {part} are {factor:.0f} times as large in one, so their units may differ"
    return ""


def _followed(one: EpisodeSet, other: EpisodeSet) -> str:
    """Return why commands and what follows them are not the same thing, or not in the same unit."""
    if one.first.fps != other.first.fps:
        return "the frame rates differ, and what follows a command is measured a frame later"
    if _pairs(one.first) != _pairs(other.first):
        return "the state measures other entries of the action"
    for group in (one, other):
        factor = _times(*group.followed())
        if factor > _FACTOR and not group.first.info.from_handrail:
            return f"commands and state differ {factor:.0f} times in size, so their units may differ"
    return ""


def _by_handrail(*episodes: Demonstration) -> bool:
    return all(episode.info.from_handrail for episode in episodes)


def _pairs(episode: Demonstration) -> list[tuple[str, str]]:
    action, state = episode.entries("action"), episode.entries("state")
    return [(action[place], state[measured]) for place, measured in episode.pairs]


def _times(one: FloatArray, other: FloatArray) -> float:
    """Return how many times as far entries of one range as those of the other, or the inverse: the median."""
    spans = [np.ptp(np.percentile(each, _PERCENT, axis=0), axis=0) for each in (one, other)]
    both = (spans[0] > _STILL) & (spans[1] > _STILL)
    if not both.any():
        return 1.0
    return float(np.exp(np.median(np.abs(np.log(spans[0][both] / spans[1][both])))))


def _few(names: Sequence[str]) -> str:
    return ", ".join(names[:_NAMED]) + (", …" if len(names) > _NAMED else "")

"""Whether numbers of two groups are in the same unit, as far as their datasets tell; if nobody knows, no.

LeRobot's format names no units. What tells: that it is one dataset; that Handrail recorded both (metres,
radians, seconds); else the same robot, the same names that say what they measure, the same rate and numbers
of the same size, all of these.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.demonstration import Demonstration, DoesNotApply
from handrail.datasets.quality.naming import quantity

Group = Sequence[Demonstration]
Needs = Literal["", "motion", "position", "action", "controller", "pool"]

_FACTOR = 10.0  # ranges that differ by more are of other units: degrees are 57 times radians
_PERCENT = (1.0, 99.0)
_STILL = 1e-9
_NAMED = 3  # names that are shown
_PARTS = ("state", "action", "asked")


def why_not(needs: Needs, one: Group, other: Group) -> str:
    """Return why a metric's values of two groups cannot be compared; "" if they can.

    Args:
        needs: What the metric's unit hangs on: nothing; what moves; the unit of that as well; what the action
            commands; whose soft limits were given up; or everything that is put on one scale.
        one: Episodes of one dataset.
        other: Of the other.
    """
    if needs == "controller":
        return _modes(one, other)
    if not needs or one[0].info.root == other[0].info.root:
        return ""
    try:
        if needs == "pool":
            return _on_one_scale(one, other)
        if needs == "action":
            return _numbers("action", one, other) or _followed(one, other)
        tools = one[0].motion_is_tool and other[0].motion_is_tool
        if tools and (needs == "motion" or _by_handrail(one[0], other[0])):
            return ""  # the same thing moves; a measure without a unit needs no more
        return _numbers("state", one, other)
    except DoesNotApply as error:
        return str(error)


def _on_one_scale(one: Group, other: Group) -> str:
    if _columns(one[0]) != _columns(other[0]):
        return "the datasets have different columns, so there is no common scale"
    parts = [part for part in _PARTS if one[0].has(part)]
    return next(filter(None, (_numbers(part, one, other) for part in parts)), "")


def _columns(episode: Demonstration) -> tuple[object, ...]:
    """Return sizes and entries of what is measured."""
    choices = (*episode.columns.choices("action"), *episode.columns.choices("asked"))
    names = sorted(name for name in episode.frames if name.startswith("observation") or name in choices)
    return tuple((name, episode.frames[name].shape[1:], episode.info.features[name].names) for name in names)


def _numbers(part: str, one: Group, other: Group) -> str:
    """Return why the numbers of a part are not known to be in the same unit."""
    first, second = one[0], other[0]
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
    factor = _times(_rows(part, one), _rows(part, other))
    if factor > _FACTOR:
        return f"the numbers of the {part} are {factor:.0f} times as large in one, so their units may differ"
    return ""


def _followed(one: Group, other: Group) -> str:
    """Return why commands and what follows them are not the same thing, or not in the same unit."""
    if one[0].fps != other[0].fps:
        return "the frame rates differ, and what follows a command is measured a frame later"
    if _pairs(one[0]) != _pairs(other[0]):
        return "the state measures other entries of the action"
    for group in (one, other):
        factor = _times(np.vstack([e.commanded for e in group]), np.vstack([e.reached for e in group]))
        if factor > _FACTOR and not group[0].info.from_handrail:
            return f"commands and state differ {factor:.0f} times in size, so their units may differ"
    return ""


def _modes(one: Group, other: Group) -> str:
    """Return why controllers may differ: each gives up limits of its own, in [m], [m/s] or a share."""
    modes = [
        {str(mode) for episode in group if episode.has("mode") for mode in np.unique(episode.column("mode"))}
        for group in (one, other)
    ]
    return "" if modes[0] == modes[1] else "the modes differ, so the controllers and their soft limits may"


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


def _rows(part: str, group: Group) -> FloatArray:
    return np.vstack([episode.matrix(part) for episode in group])


def _few(names: Sequence[str]) -> str:
    return ", ".join(names[:_NAMED]) + (", …" if len(names) > _NAMED else "")

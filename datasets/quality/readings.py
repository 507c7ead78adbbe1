"""Reading groups of episodes, one in memory at a time: once for their scale, once to measure them.

What stays are a number for every metric and episode, and of each group as many frames as are compared with
each other.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from handrail.controllers.arrays import IntArray
from handrail.datasets.demonstrations.demonstration import Demonstration, DoesNotApply
from handrail.datasets.demonstrations.episode import Episode
from handrail.datasets.demonstrations.load import each_opened
from handrail.datasets.quality.group_reading import Reading
from handrail.datasets.quality.metric import Metric
from handrail.datasets.quality.pool import FRAMES, Pool
from handrail.datasets.quality.sample import frames_of
from handrail.datasets.quality.units import why_not

Groups = Mapping[str, Sequence[Episode]]


def read_views(views: Sequence[Mapping[str, Reading]], metrics: Sequence[Metric], margin: float) -> None:
    """Read the episodes of all groups of all views.

    Args:
        views: Groups by label; an episode may be in several views, and is read with all of them.
        metrics: What is measured.
        margin: Distance to keep [m].
    """
    for groups in views:
        _share_pools(list(groups.values()), margin)
    places = _places(reading for groups in views for reading in groups.values())
    if any(metric.needs == "pool" for metric in metrics):
        for episode, where in _each(places):
            for pool in {id(reading.pool): reading.pool for reading, _ in where}.values():
                pool.add(episode)
    frames = _frames(views) if any(metric.of_group for metric in metrics) else {}
    single = [metric for metric in metrics if not metric.of_group]
    for episode, where in _each(places):
        modes = set(np.unique(episode.column("mode")).tolist()) if episode.has("mode") else set()
        for reading, place in where:
            reading.modes |= modes
            if id(reading) in frames:
                reading.sample.add(episode, frames[id(reading)][place], place)
        for metric in single:
            _measure(metric, episode, where)


Where = list[tuple[Reading, int]]  # the groups that an episode is in, and at which place


def _places(readings: Iterator[Reading]) -> list[tuple[Episode, Where]]:
    found: dict[int, tuple[Episode, Where]] = {}
    for reading in readings:
        for place, episode in enumerate(reading.episodes):
            found.setdefault(id(episode), (episode, []))[1].append((reading, place))
    return list(found.values())


def _each(places: list[tuple[Episode, Where]]) -> Iterator[tuple[Demonstration, Where]]:
    opened = each_opened(episode for episode, _ in places)
    return zip(opened, (where for _, where in places), strict=True)


def _measure(metric: Metric, episode: Demonstration, where: Where) -> None:
    """Measure an episode, once for all groups unless it hangs on their scale."""
    assert metric.measure is not None
    value, reason = np.nan, ""
    for turn, (reading, place) in enumerate(where):
        if turn == 0 or metric.needs == "pool":
            value, reason = np.nan, ""
            try:
                value = metric.measure(episode, reading.pool)
            except DoesNotApply as error:
                reason = str(error)
        reading.values[metric.name][place] = value
        if reason:
            reading.reasons[metric.name][reason] += 1


def _share_pools(readings: list[Reading], margin: float) -> None:
    """Give groups that can be put on one scale the same pool.

    The smallest group says how many frames are taken of each for what compares them with each other.
    """
    firsts: list[Reading] = []
    for reading in readings:
        fitting = [n for n, known in enumerate(firsts) if not why_not("pool", known, reading)]
        firsts += [] if fitting else [reading]
        reading.number = fitting[0] if fitting else len(firsts) - 1
    for number in range(len(firsts)):
        members = [reading for reading in readings if reading.number == number]
        fewest = min(sum(episode.count for episode in reading.episodes) for reading in members)
        pool = Pool(margin, min(FRAMES, fewest))
        for reading in members:
            reading.pool = pool


def _frames(views: Sequence[Mapping[str, Reading]]) -> dict[int, list[IntArray]]:
    """Return which frames stand for each episode of a group."""
    readings = (reading for groups in views for reading in groups.values())
    return {id(each): frames_of([e.count for e in each.episodes], each.pool.frames) for each in readings}

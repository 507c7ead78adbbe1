"""Every metric of every episode of the groups that are compared, each value or why there is none."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.group_reading import GroupReading
from handrail.datasets.quality.metric import Metric
from handrail.datasets.quality.pool import FRAMES, ObservationPool, frames_of
from handrail.datasets.quality.units import why_not
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply
from handrail.datasets.reading.episode import Episode
from handrail.datasets.reading.load import each_opened
from handrail.datasets.statistics.resampling import FEWEST, Interval, bootstrap_mean

Groups = Mapping[str, Sequence[Episode]]


def read_views(views: Sequence[Mapping[str, GroupReading]], metrics: Sequence[Metric], margin: float) -> None:
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


Where = list[tuple[GroupReading, int]]  # the groups that an episode is in, and at which place


def _places(readings: Iterator[GroupReading]) -> list[tuple[Episode, Where]]:
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


def _share_pools(readings: list[GroupReading], margin: float) -> None:
    """Give groups that can be put on one scale the same pool.

    The smallest group says how many frames are taken of each for what compares them with each other.
    """
    firsts: list[GroupReading] = []
    for reading in readings:
        fitting = [n for n, known in enumerate(firsts) if not why_not("pool", known, reading)]
        firsts += [] if fitting else [reading]
        reading.number = fitting[0] if fitting else len(firsts) - 1
    for number in range(len(firsts)):
        members = [reading for reading in readings if reading.number == number]
        fewest = min(sum(episode.count for episode in reading.episodes) for reading in members)
        pool = ObservationPool(margin, min(FRAMES, fewest))
        for reading in members:
            reading.pool = pool


def _frames(views: Sequence[Mapping[str, GroupReading]]) -> dict[int, list[IntArray]]:
    """Return which frames stand for each episode of a group."""
    readings = (reading for groups in views for reading in groups.values())
    return {id(each): frames_of([e.count for e in each.episodes], each.pool.frames) for each in readings}


@dataclass(frozen=True)
class Measured:
    """A metric of all episodes of a group.

    Attributes:
        values: `(E,)`; NaN where it does not apply.
        interval: 95 % of the mean, bootstrap; None for fewer than five episodes, and for a metric of a group,
            whose values share neighbours.
        reason: Why it applies to none, or not to all: the commonest reason; "" where it applies to all.
    """

    values: FloatArray
    interval: Interval | None = None
    reason: str = ""

    @property
    def known(self) -> FloatArray:
        """The values of the episodes to which it applies."""
        return self.values[np.isfinite(self.values)]

    @property
    def applies(self) -> bool:
        """Whether there is any value."""
        return bool(self.known.size)

    @property
    def mean(self) -> float | None:
        """Over the episodes to which it applies; None without any."""
        return float(self.known.mean()) if self.applies else None

    @property
    def content(self) -> dict[str, Any]:
        """What a report's JSON has."""
        numbers = {"count": len(self.known), "mean": self.mean, "interval": self.interval}
        return numbers | {"reason": self.reason}


@dataclass(frozen=True)
class Measurements:
    """What `measure` found.

    Attributes:
        values: By metric and group.
        groups: What was read of each group.
    """

    values: Mapping[str, Mapping[str, Measured]]
    groups: Mapping[str, GroupReading]

    def why_not(self, metric: Metric, one: str, other: str) -> str:
        """Return why a metric's values of two groups cannot be compared; "" if they can."""
        first, second = self.groups[one], self.groups[other]
        reason = why_not(metric.needs, first, second)
        if not reason and metric.needs == "pool" and first.number != second.number:
            return "they were put on different scales"
        return reason


def measure(
    groups: Groups, rng: np.random.Generator, margin: float = 0.1, metrics: Sequence[Metric] = METRICS
) -> Measurements:
    """Return every metric of every episode.

    Args:
        groups: Episodes by label.
        rng: Of what is estimated from random batches.
        margin: Distance to keep [m].
        metrics: Which.
    """
    (readings,) = read([groups], margin, metrics)
    return measured(readings, rng, metrics)


def read(
    views: Sequence[Groups], margin: float = 0.1, metrics: Sequence[Metric] = METRICS
) -> list[dict[str, GroupReading]]:
    """Read the episodes of several ways to choose them, those that are in several once for all."""
    found = [{label: GroupReading(each, metrics) for label, each in groups.items()} for groups in views]
    read_views(found, metrics, margin)
    return found


def measured(
    readings: Mapping[str, GroupReading], rng: np.random.Generator, metrics: Sequence[Metric] = METRICS
) -> Measurements:
    """Return what was read as values with intervals."""
    values = {
        metric.name: {label: _measured(metric, reading, rng) for label, reading in readings.items()}
        for metric in metrics
    }
    return Measurements(values, readings)


def _measured(metric: Metric, reading: GroupReading, rng: np.random.Generator) -> Measured:
    count = len(reading.episodes)
    if metric.measure_group is not None:
        try:
            values = metric.measure_group(reading.sample, reading.pool, rng)
            return Measured(reading.sample.mean_of_each(values, count))
        except DoesNotApply as error:
            return Measured(np.full(count, np.nan), None, str(error))
    values, reasons = reading.values[metric.name], reading.reasons[metric.name]
    known, reason = values[np.isfinite(values)], reasons.most_common(1)[0][0] if reasons else ""
    interval = bootstrap_mean(known, rng) if len(known) >= FEWEST else None
    return Measured(values, interval, reason)

"""Every metric of every episode of the groups that are compared, each value or why there is none."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.demonstrations.demonstration import DoesNotApply
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.group_reading import Reading
from handrail.datasets.quality.metric import Metric
from handrail.datasets.quality.readings import Groups, read_views
from handrail.datasets.quality.units import why_not
from handrail.datasets.statistics.resampling import FEWEST, Interval, bootstrap_mean


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


@dataclass(frozen=True)
class Measurements:
    """What `measure` found.

    Attributes:
        values: By metric and group.
        groups: What was read of each group.
    """

    values: Mapping[str, Mapping[str, Measured]]
    groups: Mapping[str, Reading]

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
) -> list[dict[str, Reading]]:
    """Read the episodes of several ways to choose them, those that are in several once for all."""
    found = [{label: Reading(each, metrics) for label, each in groups.items()} for groups in views]
    read_views(found, metrics, margin)
    return found


def measured(
    readings: Mapping[str, Reading], rng: np.random.Generator, metrics: Sequence[Metric] = METRICS
) -> Measurements:
    """Return what was read as values with intervals."""
    values = {
        metric.name: {label: _measured(metric, reading, rng) for label, reading in readings.items()}
        for metric in metrics
    }
    return Measurements(values, readings)


def _measured(metric: Metric, reading: Reading, rng: np.random.Generator) -> Measured:
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

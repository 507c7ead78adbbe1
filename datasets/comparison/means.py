"""The mean of every metric in every group, with its interval or why there is none."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import Measurements
from handrail.datasets.statistics.resampling import Interval, mean_interval


@dataclass(frozen=True)
class Mean:
    """A metric of a group.

    Attributes:
        count: Episodes that have a value.
        mean: Over these; None without any.
        interval: 95 %, bootstrap; None for fewer than five, and for a metric of a group, whose values share
            neighbours.
        reason: Why it does not apply, to all or to some; "" where it applies to all.
    """

    count: int
    mean: float | None
    interval: Interval | None
    reason: str


Means = Mapping[str, Mapping[str, Mean]]


def means(measurements: Measurements, rng: np.random.Generator) -> Means:
    """Return the means by metric and group."""
    found: dict[str, dict[str, Mean]] = {}
    of_group = {metric.name for metric in METRICS if metric.of_group}
    for name, groups in measurements.values.items():
        found[name] = {}
        for label, measured in groups.items():
            values = measured.values[np.isfinite(measured.values)]
            mean = float(values.mean()) if values.size else None
            interval = None if name in of_group else mean_interval(values, rng)
            found[name][label] = Mean(len(values), mean, interval, measured.reason)
    return found

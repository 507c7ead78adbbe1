"""All metrics of all groups that are compared, each value or why there is none."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.demonstration import Demonstration, DoesNotApply
from handrail.datasets.quality.metric import Metric
from handrail.datasets.quality.pool import Pool
from handrail.datasets.quality.units import why_not
from handrail.datasets.statistics.resampling import FEWEST, Interval, bootstrap_mean

_FRAMES = 2048  # of a group at most, for what compares every frame with every other


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


Groups = Mapping[str, Sequence[Demonstration]]


@dataclass(frozen=True)
class Measurements:
    """What `measure` found.

    Attributes:
        values: By metric and group.
        pools: Which pool a group is in: what is put on one scale only compares within one.
        groups: What was measured.
    """

    values: Mapping[str, Mapping[str, Measured]]
    pools: Mapping[str, int]
    groups: Groups

    def why_not(self, metric: Metric, one: str, other: str) -> str:
        """Return why a metric's values of two groups cannot be compared; "" if they can."""
        reason = why_not(metric.needs, self.groups[one], self.groups[other])
        if not reason and metric.needs == "pool" and self.pools[one] != self.pools[other]:
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
    numbers = _pools(groups)
    pools = {
        number: _pool([groups[label] for label in groups if numbers[label] == number], margin)
        for number in set(numbers.values())
    }
    values = {
        metric.name: {
            label: _measured(metric, episodes, pools[numbers[label]], rng)
            for label, episodes in groups.items()
        }
        for metric in metrics
    }
    return Measurements(values, numbers, groups)


def _pool(groups: Sequence[Sequence[Demonstration]], margin: float) -> Pool:
    """Return what groups have in common; the smallest says how many frames are taken of each."""
    fewest = min(sum(episode.count for episode in episodes) for episodes in groups)
    return Pool([e for episodes in groups for e in episodes], margin, min(_FRAMES, fewest))


def _pools(groups: Groups) -> dict[str, int]:
    """Return a number for each group, the same for groups that can be put on one scale."""
    first: list[str] = []  # label of each pool's first group
    numbers: dict[str, int] = {}
    for label, episodes in groups.items():
        fitting = [n for n, known in enumerate(first) if not why_not("pool", groups[known], episodes)]
        first += [] if fitting else [label]
        numbers[label] = fitting[0] if fitting else len(first) - 1
    return numbers


def _measured(
    metric: Metric, episodes: Sequence[Demonstration], pool: Pool, rng: np.random.Generator
) -> Measured:
    if metric.measure_group is not None:
        try:
            return Measured(metric.measure_group(episodes, pool, rng))
        except DoesNotApply as error:
            return Measured(np.full(len(episodes), np.nan), None, str(error))
    values, reasons = np.full(len(episodes), np.nan), Counter[str]()
    for place, episode in enumerate(episodes):
        try:
            values[place] = metric.measure(episode, pool) if metric.measure else np.nan
        except DoesNotApply as error:
            reasons[str(error)] += 1
    known, reason = values[np.isfinite(values)], reasons.most_common(1)[0][0] if reasons else ""
    interval = bootstrap_mean(known, rng) if len(known) >= FEWEST else None
    return Measured(values, interval, reason)

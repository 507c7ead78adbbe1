"""How a metric differs between two groups, with and without the length of the episodes taken into account."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.comparison.collection import shared_seeds
from handrail.datasets.comparison.groups import Group
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import Measurements
from handrail.datasets.quality.metric import Metric
from handrail.datasets.statistics.contrast import Contrast, adjusted
from handrail.datasets.statistics.resampling import (
    FEWEST,
    Interval,
    bootstrap,
    difference_of_means,
    permutation_p,
)

FOLLOWS = 0.5  # |Spearman's ρ| with length from which a metric counts as following it
_NO_SPREAD = 1e-9  # of a value: a standard deviation below is rounding


@dataclass(frozen=True, kw_only=True)
class MetricContrast(Contrast):
    """Mean of a metric in a group minus that in the baseline, over episodes.

    A metric whose unit is the dataset has an estimate alone: the values of its episodes share neighbours, and
    resampling would take them for independent.
    """

    measure: Metric
    incomparable: str = ""  # why the units of both are not known to be the same, where both have values
    spread: float | None = None  # standard deviation within groups, pooled
    at_length: float | None = None  # estimate without the linear dependence on length, within groups
    at_length_interval: Interval | None = None  # 95 %, bootstrap
    follows_length: float | None = None  # Spearman's ρ with episode length within groups

    @property
    def tested(self) -> bool:
        """Whether there are interval and p."""
        return self.interval is not None

    @property
    def effect(self) -> tuple[float, ...]:
        """Estimate and interval in standard deviations; infinite for a difference where nothing varies."""
        values = (self.estimate or 0.0, *(self.interval or (0, 0)))
        return tuple(_in_spreads(each, self.spread or 0.0) for each in values)

    @property
    def at_equal_length(self) -> bool:
        """Whether what was detected, in its direction, is also there at equal length."""
        low, high = self.at_length_interval or (0.0, 0.0)
        return self.detected and (low > 0.0 if (self.estimate or 0.0) > 0.0 else high < 0.0)


def _in_spreads(value: float, spread: float) -> float:
    if spread > _NO_SPREAD * abs(value):
        return value / spread
    return float(np.copysign(np.inf, value)) if value else 0.0


def differences(
    scope: str, groups: Sequence[Group], measurements: Measurements, baseline: str, rng: np.random.Generator
) -> list[MetricContrast]:
    """Return every metric's difference between every group and the baseline.

    Args:
        scope: Of which episodes.
        groups: Which were measured.
        measurements: Of these groups.
        baseline: The label that the others are compared with.
        rng: Of the resampling.
    """
    (base,) = [group for group in groups if group.label == baseline]
    found = []
    for group in (group for group in groups if group is not base):
        for metric in METRICS:
            numbers = _difference(metric, group, base, measurements, rng)
            numbers |= {"label": group.label, "baseline": baseline}
            numbers |= {"scope": scope, "family": f"metrics, {scope}"}
            found.append(MetricContrast(measure=metric, **numbers))
    return adjusted(found)


def _difference(
    metric: Metric, group: Group, base: Group, measurements: Measurements, rng: np.random.Generator
) -> dict[str, Any]:
    """Return the numbers of a contrast, or why there are none."""
    one, other = measured = [measurements.values[metric.name][each.label] for each in (group, base)]
    for each, values in zip((group, base), measured, strict=True):
        if values.mean is None:
            return {"reason": f"{each.label}: {values.reason}"}
    if apart := measurements.why_not(metric, group.label, base.label):
        return {"reason": f"not comparable: {apart}", "incomparable": apart}
    known, counts = [np.isfinite(each.values) for each in measured], (len(one.known), len(other.known))
    pairs = [(i, j) for i, j in shared_seeds(group, base) if known[0][i] and known[1][j]]
    chosen = np.array(pairs).T if pairs else list(map(np.flatnonzero, known))
    if min(*counts, *(() if metric.of_dataset else map(len, chosen))) < FEWEST:
        return {"reason": f"fewer than {FEWEST} episodes of a group have a value"}
    if metric.of_dataset:
        if len(one.values) != len(other.values):
            return {"reason": "it depends on the number of episodes: see the same number"}
        estimate = float(np.nanmean(one.values) - np.nanmean(other.values))
        return {"estimate": estimate, "counts": counts}
    values = [each.values[places] for each, places in zip(measured, chosen, strict=True)]
    seconds = [np.array([episode.seconds for episode in each.episodes]) for each in (group, base)]
    lengths = [each[places] for each, places in zip(seconds, chosen, strict=True)]
    return _compared(values, lengths, bool(pairs), rng)


def _compared(
    values: Sequence[FloatArray], lengths: Sequence[FloatArray], paired: bool, rng: np.random.Generator
) -> dict[str, Any]:
    def at_length(*chosen: IntArray, axis: int = -1) -> FloatArray:
        sides = ([each[at] for each, at in zip(side, chosen, strict=True)] for side in (values, lengths))
        return at_equal_length(*sides)

    one, other = values
    places = np.arange(len(one)), np.arange(len(other))
    return {
        "paired": paired,
        "counts": (len(one), len(other)),
        "estimate": float(one.mean() - other.mean()),
        "interval": bootstrap((one, other), difference_of_means, paired, rng),
        "spread": float(np.sqrt(np.mean([each.var(ddof=1) for each in values]))),
        "p": permutation_p((one, other), difference_of_means, paired, rng),
        "at_length": float(at_length(*places)),
        "at_length_interval": bootstrap(places, at_length, paired, rng),
        "follows_length": _follows(values, lengths),
    }


def at_equal_length(values: Sequence[FloatArray], lengths: Sequence[FloatArray]) -> FloatArray:
    """Return differences of means at equal length: ȳ₁ − ȳ₂ − β (L̄₁ − L̄₂), β the slope within groups, `(…)`.

    β = Σ_g Σ (L − L̄_g)(y − ȳ_g) / Σ_g Σ (L − L̄_g)²: the analysis of covariance. Values and lengths are of
    the episodes of two groups, `(…, N)` and `(…, M)`.
    """
    (one, one_length), (other, other_length) = [
        (y.mean(axis=-1), length.mean(axis=-1)) for y, length in zip(values, lengths, strict=True)
    ]
    product, square = np.zeros_like(one), np.zeros_like(one)
    for y, length in zip(values, lengths, strict=True):
        away = length - length.mean(axis=-1, keepdims=True)
        product += (away * (y - y.mean(axis=-1, keepdims=True))).sum(axis=-1)
        square += (away**2).sum(axis=-1)
    slope = np.divide(product, square, out=np.zeros_like(product), where=square > 1e-12)
    return one - other - slope * (one_length - other_length)


def _follows(values: Sequence[FloatArray], lengths: Sequence[FloatArray]) -> float:
    """Return the correlation of ranks within groups, all groups together; 0 where nothing varies."""
    ranks = [[stats.rankdata(each) / len(each) - 0.5 for each in side] for side in (values, lengths)]
    one, other = (np.concatenate([each - each.mean() for each in side]) for side in ranks)
    norm = float(np.sqrt((one @ one) * (other @ other)))
    return float(one @ other) / norm if norm else 0.0

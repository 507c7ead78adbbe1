"""How a metric differs between two groups, with and without the length of the episodes taken into account."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import stats

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.comparison.collection import shared_seeds
from handrail.datasets.comparison.groups import Group
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import Measured, Measurements
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
_TOO_FEW = f"fewer than {FEWEST} episodes of a group have a value"


@dataclass(frozen=True, kw_only=True)
class MetricContrast(Contrast):
    """Mean of a metric in a group minus that in the baseline, over episodes.

    A metric whose unit is the dataset has an estimate alone: the values of its episodes share neighbours, and
    resampling would take them for independent.

    Attributes:
        incomparable: The reason, where both have values whose units are not known to be the same.
        spread: Standard deviation within groups, pooled.
        at_length: The estimate with the metric's linear dependence on length, within groups, taken off.
        at_length_interval: 95 %, bootstrap.
        follows_length: Spearman's ρ with episode length within groups.
    """

    measure: Metric
    incomparable: str = ""
    spread: float | None = None
    at_length: float | None = None
    at_length_interval: Interval | None = None
    follows_length: float | None = None

    @property
    def tested(self) -> bool:
        """Whether there are interval and p."""
        return self.interval is not None

    @property
    def effect(self) -> tuple[float, float, float]:
        """Estimate and interval in standard deviations; infinite for a difference where nothing varies."""
        estimate, low, high = (
            _in_spreads(each, self.spread or 0.0)
            for each in (self.estimate or 0.0, *(self.interval or (0, 0)))
        )
        return estimate, low, high

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
        groups: What was measured.
        measurements: Of these groups.
        baseline: The label that the others are compared with.
        rng: Of the resampling.
    """
    (base,) = [group for group in groups if group.label == baseline]
    others = [group for group in groups if group.label != baseline]
    found = [_difference(metric, group, base, measurements, rng) for group in others for metric in METRICS]
    return adjusted(replace(each, scope=scope, family=f"metrics, {scope}") for each in found)


def _difference(
    metric: Metric, group: Group, base: Group, measurements: Measurements, rng: np.random.Generator
) -> MetricContrast:
    measured = [measurements.values[metric.name][each.label] for each in (group, base)]
    found = MetricContrast(measure=metric, label=group.label, baseline=base.label)
    for each, values in zip((group, base), measured, strict=True):
        if values.mean is None:
            return replace(found, reason=f"{each.label}: {values.reason}")
    apart = measurements.why_not(metric, group.label, base.label)
    if apart:
        return replace(found, reason=f"not comparable: {apart}", incomparable=apart)
    one, other = (np.isfinite(each.values) for each in measured)
    if min(one.sum(), other.sum()) < FEWEST:
        return replace(found, reason=_TOO_FEW)
    if metric.of_dataset:
        return _described(found, *measured)
    pairs = [(i, j) for i, j in shared_seeds(group, base) if one[i] and other[j]]
    chosen = np.array(pairs).T if pairs else (np.flatnonzero(one), np.flatnonzero(other))
    if min(map(len, chosen)) < FEWEST:
        return replace(found, reason=_TOO_FEW)
    values = [each.values[places] for each, places in zip(measured, chosen, strict=True)]
    seconds = [np.array([episode.seconds for episode in each.episodes]) for each in (group, base)]
    lengths = [each[places] for each, places in zip(seconds, chosen, strict=True)]
    return replace(found, **_compared(values, lengths, bool(pairs), rng))


def _described(found: MetricContrast, one: Measured, other: Measured) -> MetricContrast:
    """Return how a measure of whole datasets differs, where they have as many episodes."""
    if len(one.values) != len(other.values):
        return replace(found, reason="it depends on the number of episodes: see the same number")
    estimate = float(np.nanmean(one.values) - np.nanmean(other.values))
    return replace(found, estimate=estimate, counts=(len(one.known), len(other.known)))


def _compared(
    values: Sequence[FloatArray], lengths: Sequence[FloatArray], paired: bool, rng: np.random.Generator
) -> dict[str, Any]:
    def at_length(first: IntArray, second: IntArray, axis: int = -1) -> FloatArray:
        chosen = (first, second)
        return at_equal_length(
            [each[places] for each, places in zip(values, chosen, strict=True)],
            [each[places] for each, places in zip(lengths, chosen, strict=True)],
        )

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
    """Return differences of means at equal length: ȳ₁ − ȳ₂ − β (L̄₁ − L̄₂), β the slope within groups.

    β = Σ_g Σ (L − L̄_g)(y − ȳ_g) / Σ_g Σ (L − L̄_g)²: the analysis of covariance.

    Args:
        values: Of two groups, `(…, N)` and `(…, M)`.
        lengths: Of the same episodes.

    Returns:
        `(…)`.
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

"""How a metric differs between two groups, with and without the length of the episodes taken into account."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.comparison.collection import shared_seeds
from handrail.datasets.comparison.groups import Group
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import Measured, Measurements
from handrail.datasets.quality.metric import Metric
from handrail.datasets.statistics.proportions import LEVEL, holm
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


@dataclass(frozen=True)
class Difference:
    """Mean of a metric in a group minus that in the baseline, over episodes.

    Attributes:
        metric: Which.
        label: The group.
        baseline: The other one.
        reason: Why there is no difference to speak of; "" if there is one.
        incomparable: That reason, where both have values whose units are not known to be the same.
        paired: Whether episodes with the same start were compared.
        counts: Episodes of both that count.
        tested: Whether there are interval and p. Not for a metric of a group: the values of its episodes
            share neighbours, and resampling would take them for independent.
        estimate: In the metric's unit.
        interval: 95 %, bootstrap.
        spread: Standard deviation within groups, pooled.
        p: Permutation test, two-sided.
        p_adjusted: By Holm, over all metrics and groups that are tested.
        at_length: The estimate with the metric's linear dependence on length, within groups, taken off.
        at_length_interval: 95 %, bootstrap.
        follows_length: Spearman's ρ with episode length within groups.
    """

    metric: Metric
    label: str
    baseline: str
    reason: str = ""
    incomparable: str = ""
    paired: bool = False
    counts: tuple[int, int] = (0, 0)
    tested: bool = True
    estimate: float = float("nan")
    interval: Interval = (float("nan"), float("nan"))
    spread: float = float("nan")
    p: float = 1.0
    p_adjusted: float = 1.0
    at_length: float = float("nan")
    at_length_interval: Interval = (float("nan"), float("nan"))
    follows_length: float = float("nan")

    @property
    def detected(self) -> bool:
        """Whether the interval leaves zero out and the adjusted p is below 0.05."""
        if self.reason or not self.tested:
            return False
        return self.p_adjusted < LEVEL and not self.interval[0] <= 0.0 <= self.interval[1]

    @property
    def effect(self) -> tuple[float, float, float]:
        """Estimate and interval in standard deviations; infinite for a difference where nothing varies."""
        low, high = (_in_spreads(end, self.spread) for end in self.interval)
        return _in_spreads(self.estimate, self.spread), low, high

    @property
    def at_equal_length(self) -> bool:
        """Whether what was detected, in its direction, is also there at equal length."""
        low, high = self.at_length_interval
        return self.detected and (low > 0.0 if self.estimate > 0.0 else high < 0.0)


def _in_spreads(value: float, spread: float) -> float:
    if spread > _NO_SPREAD * abs(value):
        return value / spread
    return float(np.copysign(np.inf, value)) if value else 0.0


def differences(
    groups: Sequence[Group], measurements: Measurements, baseline: str, rng: np.random.Generator
) -> list[Difference]:
    """Return every metric's difference between every group and the baseline.

    Args:
        groups: What was measured.
        measurements: Of these groups.
        baseline: The label that the others are compared with.
        rng: Of the resampling.
    """
    (base,) = [group for group in groups if group.label == baseline]
    others = [group for group in groups if group.label != baseline]
    found = [_difference(metric, group, base, measurements, rng) for group in others for metric in METRICS]
    adjusted = iter(holm([d.p for d in found if d.tested and not d.reason]))
    return [replace(d, p_adjusted=next(adjusted)) if d.tested and not d.reason else d for d in found]


def _difference(
    metric: Metric, group: Group, base: Group, measurements: Measurements, rng: np.random.Generator
) -> Difference:
    measured = [measurements.values[metric.name][each.label] for each in (group, base)]
    names = {"metric": metric, "label": group.label, "baseline": base.label}
    for each, values in zip((group, base), measured, strict=True):
        if not values.applies:
            return Difference(**names, reason=f"{each.label}: {values.reason}")
    apart = measurements.why_not(metric, group.label, base.label)
    if apart:
        return Difference(**names, reason=f"not comparable: {apart}", incomparable=apart)
    if metric.of_group:
        return _described(Difference(**names, tested=False), measured[0], measured[1])
    one, other = (np.isfinite(each.values) for each in measured)
    pairs = [(i, j) for i, j in shared_seeds(group, base) if one[i] and other[j]]
    chosen = np.array(pairs).T if pairs else (np.flatnonzero(one), np.flatnonzero(other))
    if min(map(len, chosen)) < FEWEST:
        return Difference(**names, reason=_TOO_FEW)
    values = [each.values[places] for each, places in zip(measured, chosen, strict=True)]
    lengths = [
        np.array([episode.seconds for episode in each.episodes])[places]
        for each, places in zip((group, base), chosen, strict=True)
    ]
    return replace(Difference(**names), **_compared(values, lengths, bool(pairs), rng))


def _described(difference: Difference, one: Measured, other: Measured) -> Difference:
    """Return how a metric of a group differs, without a test, where the groups have as many episodes."""
    counts = int(np.isfinite(one.values).sum()), int(np.isfinite(other.values).sum())
    if min(counts) < FEWEST:
        return replace(difference, reason=_TOO_FEW)
    if len(one.values) != len(other.values):
        return replace(difference, reason="it depends on the number of episodes: see the same number")
    estimate = float(np.nanmean(one.values) - np.nanmean(other.values))
    return replace(difference, counts=counts, estimate=estimate)


def _compared(
    values: Sequence[FloatArray], lengths: Sequence[FloatArray], paired: bool, rng: np.random.Generator
) -> dict[str, object]:
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

"""How a metric differs between two groups, with and without the length of the episodes taken into account."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from scipy import stats

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.comparison.collection import shared_seeds
from handrail.datasets.comparison.groups import Group
from handrail.datasets.quality.measure import Measurements
from handrail.datasets.quality.metric import Metric
from handrail.datasets.statistics.contrast import Contrast, Estimate, adjusted, contrast
from handrail.datasets.statistics.resampling import FEWEST, bootstrap, difference_of_means, p_of_means

Sides = Sequence[FloatArray]  # of both groups
FOLLOWS = 0.5  # |Spearman's ρ| with length from which a metric counts as following it


def differences(
    groups: Sequence[Group], measurements: Measurements, baseline: str, rng: np.random.Generator
) -> list[Contrast]:
    """Return every metric's difference between every group and the baseline.

    Args:
        groups: Which were measured.
        measurements: Of these groups.
        baseline: The label that the others are compared with.
        rng: Of the resampling.
    """
    (base,) = [group for group in groups if group.label == baseline]
    others = [group for group in groups if group is not base]
    return adjusted(
        _difference(metric, group, base, measurements, rng)
        for group in others
        for metric in measurements.metrics
    )


def _difference(
    metric: Metric, group: Group, base: Group, measurements: Measurements, rng: np.random.Generator
) -> Contrast:
    """Return a contrast, or why there is none."""
    one, other = measured = [measurements.values[metric.name][each.label] for each in (group, base)]
    ask = partial(contrast, one, other, family=f"metrics, {one.scope}")
    for each in measured:
        if each.estimate is None:
            return ask(Estimate(), reason=f"{each.label}: {each.reason}")
    if apart := measurements.why_not(metric, group.label, base.label):
        return ask(Estimate(), reason=f"not comparable: {apart}", incomparable=apart)
    known, counts = [np.isfinite(each.values) for each in measured], (len(one.known), len(other.known))
    pairs = [(i, j) for i, j in shared_seeds(group, base) if known[0][i] and known[1][j]]
    chosen = np.array(pairs).T if pairs else list(map(np.flatnonzero, known))
    if min(*counts, *(() if metric.of_dataset else map(len, chosen))) < FEWEST:
        return ask(Estimate(), reason=f"fewer than {FEWEST} episodes of a group have a value")
    if metric.of_dataset:
        if len(one.values) != len(other.values):
            return ask(Estimate(), reason="it depends on the number of episodes: see the same number")
        estimate = (one.estimate or 0.0) - (other.estimate or 0.0)
        return ask(Estimate(estimate=estimate, counts=counts))
    values = [each.values[places] for each, places in zip(measured, chosen, strict=True)]
    seconds = [np.array([episode.seconds for episode in each.episodes]) for each in (group, base)]
    lengths = [each[places] for each, places in zip(seconds, chosen, strict=True)]
    tests = len(measurements.metrics) * (len(measurements.groups) - 1)
    return ask(Estimate(), **_compared(values, lengths, bool(pairs), rng, tests))


def _compared(
    values: Sides, lengths: Sides, paired: bool, rng: np.random.Generator, tests: int
) -> dict[str, Any]:
    """Return how means differ, and how much of that the lengths of the episodes account for."""

    def at_length(*chosen: IntArray, axis: int = -1) -> FloatArray:
        sides = ([each[at] for each, at in zip(side, chosen, strict=True)] for side in (values, lengths))
        return at_equal_length(*sides)

    (one, other), places = values, tuple(np.arange(len(each)) for each in values)
    return {
        "paired": paired,
        "counts": (len(one), len(other)),
        "estimate": float(one.mean() - other.mean()),
        "interval": bootstrap((one, other), difference_of_means, paired, rng),
        "p": p_of_means((one, other), paired, rng, tests),
        "spread": float(np.sqrt(np.mean([each.var(ddof=1) for each in values]))),
        "at_length": float(at_length(*places)),
        "at_length_interval": bootstrap(places, at_length, paired, rng),
        "follows_length": _follows(values, lengths),
    }


def at_equal_length(values: Sides, lengths: Sides) -> FloatArray:
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


def _follows(values: Sides, lengths: Sides) -> float:
    """Return the correlation of ranks within groups, all groups together; 0 where nothing varies."""
    ranks = [[stats.rankdata(each) / len(each) - 0.5 for each in side] for side in (values, lengths)]
    one, other = (np.concatenate([each - each.mean() for each in side]) for side in ranks)
    norm = float(np.sqrt((one @ one) * (other @ other)))
    return float(one @ other) / norm if norm else 0.0

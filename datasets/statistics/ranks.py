"""Whether one number goes with another: rank correlation within strata, whatever these differ in."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.errors import HandrailError
from handrail.datasets.statistics.replicates import wider
from handrail.datasets.statistics.resampling import RESAMPLES, Interval, percentiles

_ERROR = 1.03  # standard error of Fisher's z for ranks, times √(n − 3) (Fieller, Hartley and Pearson 1957)
_Z = float(stats.norm.ppf(0.975))
_SAME = 1e-9


@dataclass(frozen=True)
class RankCorrelation:
    """Spearman's ρ of ranks within strata.

    Attributes:
        units: How many were ranked, in strata of two or more.
        strata: How many of these.
        estimate: −1 to 1.
        interval: 95 %: the wider of the bootstrap's over units within strata and of Fisher's z with as many
            degrees of freedom as units less strata; −1 to 1 for fewer than three.
        p: Two-sided, units exchanged within strata.
    """

    units: int
    strata: int
    estimate: float
    interval: Interval
    p: float


def rank_correlation(
    first: FloatArray, second: FloatArray, strata: Sequence[Hashable], rng: np.random.Generator
) -> RankCorrelation | None:
    """Return how two numbers of the same units go together; None where one of them never varies in a stratum.

    ρ = Σ_s Σ_i x_i y_i / √(Σ x² Σ y²), x and y the ranks within stratum s over its size, less their mean.

    Args:
        first: `(N,)`; units with a number that is not finite are left out.
        second: `(N,)`.
        strata: Which stratum each is in, `(N,)`.
        rng: Of the resampling and the permutations.

    Raises:
        HandrailError: The sizes differ.
    """
    one, other = np.asarray(first, float), np.asarray(second, float)
    if not one.shape == other.shape == (len(strata),):
        raise HandrailError(
            f"rank correlation: expected equal sizes, got {one.size}, {other.size} and {len(strata)}"
        )
    members: dict[Hashable, list[int]] = {}
    for place in np.flatnonzero(np.isfinite(one) & np.isfinite(other)):
        members.setdefault(strata[place], []).append(int(place))
    groups = [np.array(each) for each in members.values() if len(each) > 1]
    if not groups:
        return None
    ranked = [(_ranks(one[each]), _ranks(other[each])) for each in groups]
    x, y = (np.concatenate(side) for side in zip(*ranked, strict=True))
    estimate = float(_correlation(x, y))
    if not np.isfinite(estimate):
        return None
    units = len(x)
    resampled = _resampled(one, other, groups, rng)
    interval = wider(percentiles(resampled), _fisher(estimate, units, units - len(groups)), -1.0, 1.0)
    exchanged = np.hstack([rng.permuted(np.tile(each, (RESAMPLES, 1)), axis=1) for _, each in ranked])
    extreme = np.abs(_correlation(x, exchanged)) >= abs(estimate) - _SAME
    p = (1.0 + np.count_nonzero(extreme)) / (RESAMPLES + 1.0)
    return RankCorrelation(units, len(groups), estimate, interval, float(p))


def _resampled(
    one: FloatArray, other: FloatArray, groups: Sequence[IntArray], rng: np.random.Generator
) -> FloatArray:
    """Return ρ of units drawn with replacement within strata, those that are numbers."""
    drawn = [rng.choice(each, (RESAMPLES, len(each))) for each in groups]
    x, y = (np.hstack([_ranks(values[each]) for each in drawn]) for values in (one, other))
    found = _correlation(x, y)
    return found[np.isfinite(found)]


def _ranks(values: FloatArray) -> FloatArray:
    """Return ranks along the last axis over their number, less their mean."""
    ranks = stats.rankdata(values, axis=-1) / values.shape[-1]
    return ranks - ranks.mean(axis=-1, keepdims=True)


def _correlation(x: FloatArray, y: FloatArray) -> FloatArray:
    norm = np.sqrt((x**2).sum(axis=-1) * (y**2).sum(axis=-1))
    product = (x * y).sum(axis=-1)
    return np.divide(product, norm, out=np.full_like(np.asarray(product), np.nan), where=norm > _SAME)


def _fisher(estimate: float, units: int, freedom: int) -> Interval:
    """Return tanh(artanh ρ ± 1.96 · 1.03 / √(f − 2)), f = n − 1 of one stratum.

    |ρ| counts as 1 − 1/n at most: a few units may agree wholly by chance, and would leave no width.
    """
    if freedom < 3:
        return -1.0, 1.0
    most = 1.0 - 1.0 / units
    centre = float(np.arctanh(np.clip(estimate, -most, most)))
    half = _Z * _ERROR / float(np.sqrt(freedom - 2.0))
    return float(np.tanh(centre - half)), float(np.tanh(centre + half))

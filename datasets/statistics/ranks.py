"""Whether one number goes with another: rank correlation within strata, whatever these differ in."""

import math
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
_FEW = 3  # blocks that tell no interval


@dataclass(frozen=True)
class RankCorrelation:
    """Spearman's ρ of ranks within strata.

    Attributes:
        units: How many were ranked, in strata of two or more.
        blocks: How many blocks these are: what varies on its own.
        estimate: −1 to 1.
        interval: 95 %: the wider of the bootstrap's over blocks and of Fisher's z with as many degrees of
            freedom as units less strata; −1 to 1 for fewer than four blocks.
        p: Two-sided, blocks exchanged.
    """

    units: int
    blocks: int
    estimate: float
    interval: Interval
    p: float

    @property
    def least_p(self) -> float:
        """The smallest p that any numbers could have: of B! orders two agree wholly, there and back."""
        return min(1.0, 2.0 / math.factorial(self.blocks))


def rank_correlation(
    first: FloatArray,
    second: FloatArray,
    strata: Sequence[Hashable],
    blocks: Sequence[Hashable],
    rng: np.random.Generator,
) -> RankCorrelation | None:
    """Return how two numbers of the same units go together; None where one of them never varies in a stratum.

    ρ = Σ_s Σ_i x_i y_i / √(Σ x² Σ y²), x and y the ranks within stratum s over its size, less their mean.

    Args:
        first: `(N,)`; units with a number that is not finite are left out.
        second: `(N,)`.
        strata: Which stratum each is in, `(N,)`.
        blocks: Which block each is in, `(N,)`: units of one block, one of a stratum at the most, share what
            made them, and are exchanged and resampled together.
        rng: Of the resampling and the permutations.

    Raises:
        HandrailError: The sizes differ.
    """
    one, other = np.asarray(first, float), np.asarray(second, float)
    if not one.shape == other.shape == (len(strata),) == (len(blocks),):
        raise HandrailError(
            f"rank correlation: expected equal sizes, got {one.size}, {other.size}, {len(strata)} and"
            f" {len(blocks)}"
        )
    members: dict[Hashable, list[int]] = {}
    for place in np.flatnonzero(np.isfinite(one) & np.isfinite(other)):
        members.setdefault(strata[place], []).append(int(place))
    numbers = {block: number for number, block in enumerate(dict.fromkeys(blocks))}
    code = np.array([numbers[block] for block in blocks], int)
    groups = [np.array(sorted(each, key=code.item)) for each in members.values() if len(each) > 1]
    if not groups:
        return None
    sides = [[_ranks(side[each]) for each in groups] for side in (one, other)]
    x, y = map(np.concatenate, sides)
    estimate = float(_correlation(x, y))
    if not np.isfinite(estimate):
        return None
    present, inverse = np.unique(code[np.concatenate(groups)], return_inverse=True)
    codes = np.split(inverse, np.cumsum([len(each) for each in groups])[:-1])
    order = rng.random((RESAMPLES, len(present)))
    pairs = zip(sides[1], codes, strict=True)
    exchanged = np.hstack([ranks[order[:, code].argsort(axis=1)] for ranks, code in pairs])
    extreme = np.abs(_correlation(x, exchanged)) >= abs(estimate) - _SAME
    p = (1.0 + np.count_nonzero(extreme)) / (RESAMPLES + 1.0)
    interval = (-1.0, 1.0)
    if len(present) > _FEW:
        drawn = rng.integers(len(present), size=(RESAMPLES, len(present)))
        found = _correlation(*(_resampled(side, groups, codes, drawn) for side in (one, other)))
        fisher = _fisher(estimate, len(x), len(x) - len(groups))
        interval = wider(percentiles(found[np.isfinite(found)]), fisher, -1.0, 1.0)
    return RankCorrelation(len(x), len(present), estimate, interval, float(p))


def _resampled(
    values: FloatArray, groups: Sequence[IntArray], codes: Sequence[IntArray], drawn: IntArray
) -> FloatArray:
    """Return the ranks of the units of blocks drawn with replacement, `(R, S B)`."""
    table = np.full((len(groups), drawn.shape[1]), np.nan)
    for row, group, code in zip(table, groups, codes, strict=True):
        row[code] = values[group]
    return np.hstack([_ranks(row[drawn]) for row in table])


def _ranks(values: FloatArray) -> FloatArray:
    """Return ranks along the last axis over their number, less their mean; 0 for what is not a number."""
    known = np.isfinite(values)
    ranks = stats.rankdata(np.where(known, values, np.inf), axis=-1)
    count = np.maximum(known.sum(axis=-1, keepdims=True), 1)
    return np.where(known, (ranks - 0.5 * (count + 1.0)) / count, 0.0)


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

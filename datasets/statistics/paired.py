"""Statistics of paired comparisons: the same trials under two conditions."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.datasets.statistics.resampling import bootstrap_mean

_RESAMPLES = 5000
_Z = float(stats.norm.ppf(0.975))


@dataclass(frozen=True)
class PairedDifference:
    """How a measure differs between two conditions over N pairs, first minus second.

    Attributes:
        pairs: N, pairs in which both are numbers.
        mean: of the differences.
        t_interval: 95 % interval of the mean by Student's t.
        bootstrap_interval: the same by resampling pairs (percentiles).
        p_wilcoxon: of Wilcoxon's signed-rank test, two-sided; 1 when nothing differs.
    """

    pairs: int
    mean: float
    t_interval: tuple[float, float]
    bootstrap_interval: tuple[float, float]
    p_wilcoxon: float


@dataclass(frozen=True)
class PairedSuccess:
    """How often two conditions differ in success over N pairs.

    Attributes:
        pairs: N.
        only_first: pairs in which only the first succeeds.
        only_second: pairs in which only the second does.
        p_mcnemar: of McNemar's exact test, two-sided.
    """

    pairs: int
    only_first: int
    only_second: int
    p_mcnemar: float


def paired_difference(first: FloatArray, second: FloatArray, rng: np.random.Generator) -> PairedDifference:
    """Compare a measure under two conditions; pairs with a number that is not finite are left out.

    Args:
        first: of every trial under one condition, (N,).
        second: of the same trials under the other, (N,).
        rng: of the resampling.
    """
    differences = _differences(first, second)
    count, mean = len(differences), float(differences.mean())
    half = float(stats.t.ppf(0.975, count - 1) * differences.std(ddof=1) / np.sqrt(count))
    resampled = bootstrap_mean(differences, rng, _RESAMPLES)
    p = float(np.asarray(stats.wilcoxon(differences))[1]) if differences.any() else 1.0
    return PairedDifference(count, mean, (mean - half, mean + half), resampled, p)


def paired_success(first: FloatArray, second: FloatArray) -> PairedSuccess:
    """Compare success (0 or 1) of the same trials under two conditions, (N,) each."""
    one, other = np.asarray(first, dtype=bool), np.asarray(second, dtype=bool)
    if one.shape != other.shape or not len(one):
        raise HandrailError(f"paired success: expected two equal sizes, got {one.size} and {other.size}")
    only_first, only_second = int(np.sum(one & ~other)), int(np.sum(~one & other))
    discordant = only_first + only_second
    p = float(stats.binomtest(only_first, discordant, 0.5).pvalue) if discordant else 1.0
    return PairedSuccess(len(one), only_first, only_second, p)


def wilson(successes: float, trials: float) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share p of n trials.

    (p + z²/2n ± z √(p (1 − p) / n + z²/4n²)) / (1 + z²/n).

    Args:
        successes: n p.
        trials: n; not whole where trials depend on each other and so count for less than one.
    """
    if not 0.0 <= successes <= trials or trials <= 0.0:
        raise HandrailError(f"share: expected 0 <= successes <= trials, got {successes} of {trials}")
    share, square = successes / trials, _Z**2 / trials
    half = float(np.sqrt(square * share * (1.0 - share) + 0.25 * square**2))
    low, high = ((share + 0.5 * square + side * half) / (1.0 + square) for side in (-1.0, 1.0))
    return (0.0 if successes == 0 else low), (1.0 if successes == trials else high)


def _differences(first: FloatArray, second: FloatArray) -> FloatArray:
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if first.shape != second.shape or first.ndim != 1:
        raise HandrailError(
            f"paired difference: expected two equal sizes, got {first.size} and {second.size}"
        )
    finite = np.isfinite(first) & np.isfinite(second)
    if np.sum(finite) < 2:
        raise HandrailError(f"paired difference: expected two pairs or more, got {int(np.sum(finite))}")
    return first[finite] - second[finite]

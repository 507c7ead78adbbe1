"""Statistics of paired comparisons: the same trials under two conditions."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.datasets.statistics.resampling import Interval, bootstrap_mean

_RESAMPLES = 5000
_Z = float(stats.norm.ppf(0.975))


@dataclass(frozen=True)
class PairedDifference:
    """How a measure differs between two conditions over pairs, first minus second."""

    pairs: int  # in which both are numbers
    mean: float
    t_interval: Interval  # 95 %, by Student's t
    bootstrap_interval: Interval  # 95 %, by resampling pairs (percentiles)
    p_wilcoxon: float  # of the signed-rank test, two-sided; 1 when nothing differs


@dataclass(frozen=True)
class PairedSuccess:
    """How often two conditions differ in success over pairs."""

    pairs: int
    only_first: int  # pairs in which only the first succeeds
    only_second: int
    p_mcnemar: float  # of the exact test, two-sided


def paired_difference(first: FloatArray, second: FloatArray, rng: np.random.Generator) -> PairedDifference:
    """Compare a measure of the same trials, `(N,)` each; pairs that are not finite are left out."""
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if first.shape != second.shape or first.ndim != 1:
        raise HandrailError(f"paired difference: expected equal sizes, got {first.size} and {second.size}")
    differences = (first - second)[np.isfinite(first) & np.isfinite(second)]
    if len(differences) < 2:
        raise HandrailError(f"paired difference: expected two pairs or more, got {len(differences)}")
    count, mean = len(differences), float(differences.mean())
    half = float(stats.t.ppf(0.975, count - 1) * differences.std(ddof=1) / np.sqrt(count))
    resampled = bootstrap_mean(differences, rng, _RESAMPLES)
    p = float(np.asarray(stats.wilcoxon(differences))[1]) if differences.any() else 1.0
    return PairedDifference(count, mean, (mean - half, mean + half), resampled, p)


def paired_success(first: FloatArray, second: FloatArray) -> PairedSuccess:
    """Compare success (0 or 1) of the same trials under two conditions, (N,) each."""
    one, other = np.asarray(first, dtype=bool), np.asarray(second, dtype=bool)
    if one.shape != other.shape or not len(one):
        raise HandrailError(f"paired success: expected equal sizes, got {one.size} and {other.size}")
    only_first, only_second = int(np.sum(one & ~other)), int(np.sum(~one & other))
    discordant = only_first + only_second
    p = float(stats.binomtest(only_first, discordant, 0.5).pvalue) if discordant else 1.0
    return PairedSuccess(len(one), only_first, only_second, p)


def wilson(successes: float, trials: float) -> Interval:
    """Return Wilson's 95 % interval of a share p of n trials.

    (p + z²/2n ± z √(p (1 − p) / n + z²/4n²)) / (1 + z²/n). n p and n are not whole where trials
    depend on each other and so count for less than one.
    """
    if not 0.0 <= successes <= trials or trials <= 0.0:
        raise HandrailError(f"share: expected 0 <= successes <= trials, got {successes} of {trials}")
    share, square = successes / trials, _Z**2 / trials
    half = float(np.sqrt(square * share * (1.0 - share) + 0.25 * square**2))
    low, high = ((share + 0.5 * square + side * half) / (1.0 + square) for side in (-1.0, 1.0))
    return (0.0 if successes == 0 else low), (1.0 if successes == trials else high)

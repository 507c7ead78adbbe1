"""Shares of successes and how they differ: intervals and exact tests, after Newcombe 1998.

Newcombe, "Interval estimation for the difference between independent proportions" (Statistics in Medicine 17,
873–890) and "Improved confidence intervals for the difference between binomial proportions based on paired
data" (2635–2650), method 10 of each.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import stats

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.statistics.contrast import Estimate, reach
from handrail.datasets.statistics.paired import paired_success, wilson
from handrail.datasets.statistics.resampling import Interval

_MOST = 250_000  # tables: 500 trials each; Boschloo's test of 1000 each takes 20 s


def independent_trials(values: FloatArray, scenes: Sequence[int]) -> float:
    """Return how many independent trials those are worth of which several met the same scene.

    n = M Var / Var_scenes, within the number of scenes J and that of trials M, with the variance of a mean of
    trials that have nothing in common, and that of one whose scenes are drawn with all their trials:
    J / (J − 1) Σ_j (Σ_{i in j} (y_i − ȳ))² / M².

    Args:
        values: y, `(M,)`.
        scenes: Which scene each met, `(M,)`.
    """
    _, owner = np.unique(np.asarray(scenes), return_inverse=True)
    away, most, least = values - values.mean(), len(values), int(owner.max()) + 1
    alone = float(away @ away) * most / max(1, most - 1)
    together = float((np.bincount(owner, weights=away) ** 2).sum()) * least / max(1, least - 1)
    if not alone or least < 2:
        return float(least)
    return float(np.clip(most * alone / max(together, 1e-12), least, most))


def paired_shares(
    first: Sequence[bool], second: Sequence[bool], scenes: Sequence[int] | None = None
) -> Estimate:
    """Compare successes of the same trials under two conditions.

    Args:
        first: `(N,)`.
        second: `(N,)`.
        scenes: The scene of each pair, `(N,)`: for the interval and the error those of a scene count
            for as many as they are worth, and the test turns them together; None where each is for itself.
    """
    one, other = np.asarray(first, bool), np.asarray(second, bool)
    found, differences = paired_success(one, other), one.astype(int) - other
    scenes = range(found.pairs) if scenes is None else scenes
    worth = independent_trials(differences, scenes) / found.pairs
    both, neither = int(np.sum(one & other)), int(np.sum(~one & ~other))
    cells = [worth * count for count in (both, found.only_first, found.only_second, neither)]
    pairs = sum(cells)
    discordant = (cells[1] + cells[2] + 2.0) / (pairs + 4.0)
    error = max(np.sqrt(discordant / pairs), reach() / pairs)  # a difference is so much discordance at least
    return Estimate(
        estimate=(found.only_first - found.only_second) / found.pairs,
        interval=newcombe_paired(*cells),
        p=mcnemar_by_scene(differences, scenes),
        counts=(found.pairs,),
        errors=((float(error), np.inf),),
        paired=True,
        largest=1.0,
    )


def mcnemar_by_scene(differences: IntArray, scenes: Sequence[int]) -> float:
    """Return P(|Σ_j ± d_j| ≥ |Σ_j d_j|), d_j the sum over the pairs of scene j, signs fair and independent.

    Under the null hypothesis the conditions may be exchanged in a scene, for all its pairs at once. Exact;
    McNemar's exact test where no scene repeats.

    Args:
        differences: Success under the first condition minus that under the second, `(N,)`: −1, 0 or 1.
        scenes: Which scene each pair met, `(N,)`.
    """
    _, owner = np.unique(np.asarray(scenes), return_inverse=True)
    sums = np.bincount(owner, weights=differences).round().astype(int)
    chances = np.ones(1)  # of every sum from −Σ |d_j| to Σ |d_j|
    for size in np.abs(sums[sums != 0]):
        step = np.zeros(2 * size + 1)
        step[[0, -1]] = 0.5
        chances = np.convolve(chances, step)
    away = np.abs(np.arange(len(chances)) - len(chances) // 2)
    return min(1.0, float(chances[away >= abs(sums.sum())].sum()))


def unpaired_shares(
    first: Sequence[bool], second: Sequence[bool], scenes: tuple[Sequence[int], Sequence[int]] | None = None
) -> Estimate:
    """Compare successes of different trials under two conditions.

    p is Boschloo's; of more than 500 trials each Fisher's, which is never smaller and hardly larger there.

    Args:
        first: `(N,)`.
        second: `(M,)`.
        scenes: The scenes of the trials of each, `(N,)` and `(M,)`, as for `paired_shares`.
    """
    one, other = (int(np.sum(first)), len(first)), (int(np.sum(second)), len(second))
    owners = scenes or (range(one[1]), range(other[1]))
    values = [np.asarray(each, float) for each in (first, second)]
    worth = [independent_trials(each, owner) for each, owner in zip(values, owners, strict=True)]
    shares = one[0] / one[1], other[0] / other[1]
    trials = [round(each) for each in worth]
    hits = [round(share * count) for share, count in zip(shares, trials, strict=True)]
    table = [hits, [count - hit for count, hit in zip(trials, hits, strict=True)]]
    exact: Any = stats.boschloo_exact if trials[0] * trials[1] <= _MOST else stats.fisher_exact
    share = (one[0] + other[0] + 2) / (one[1] + other[1] + 4)
    return Estimate(
        estimate=shares[0] - shares[1],
        interval=newcombe((shares[0] * worth[0], worth[0]), (shares[1] * worth[1], worth[1])),
        p=float(exact(table).pvalue),
        counts=(one[1], other[1]),
        errors=((_error_apart(share, worth), np.inf),),
        largest=1.0,
    )


def _error_apart(share: float, trials: Sequence[float]) -> float:
    """Return the standard error of a difference of shares where there is one that can be detected.

    √(s (1 − s) / n₁ + s' (1 − s') / n₂), s' nearer to ½ by what is detected: near 0 and 1 that varies more.
    """
    moved = share
    for _ in range(20):
        error = np.sqrt(share * (1 - share) / min(trials) + moved * (1 - moved) / max(trials))
        moved = share + np.clip(0.5 - share, -reach() * error, reach() * error)
    return float(max(error, np.sqrt(share * (1 - share) * sum(1 / each for each in trials))))


def newcombe_paired(both: float, only_first: float, only_second: float, neither: float) -> Interval:
    """Return the 95 % interval of the difference of two paired shares (method 10).

    The Wilson intervals of the two shares, combined as squares with their correlation φ̂ taken off; the
    numerator of φ̂ is brought nearer to zero by n/2 where it is positive.

    Args:
        both: Pairs that succeeded twice; these numbers need not be whole where pairs count for less than one.
        only_first: That succeeded under the first condition only.
        only_second: Under the second only.
        neither: Under none.
    """
    count = both + only_first + only_second + neither
    phi = _correlation(both, only_first, only_second, neither)
    return newcombe((both + only_first, count), (both + only_second, count), phi)


def newcombe(first: tuple[float, float], second: tuple[float, float], phi: float = 0.0) -> Interval:
    """Return the 95 % interval of the difference of two shares (method 10).

    Args:
        first: Successes and trials of the first.
        second: Of the second.
        phi: Correlation of the two; 0 where they are independent.
    """
    (low_1, high_1), (low_2, high_2) = wilson(*first), wilson(*second)
    share_1, share_2 = first[0] / first[1], second[0] / second[1]
    difference = share_1 - share_2
    return (
        difference - _combined(share_1 - low_1, high_2 - share_2, phi),
        difference + _combined(high_1 - share_1, share_2 - low_2, phi),
    )


def _correlation(both: float, only_first: float, only_second: float, neither: float) -> float:
    rows = (both + only_first) * (only_second + neither) * (both + only_second) * (only_first + neither)
    if not rows:
        return 0.0
    half = 0.5 * (both + only_first + only_second + neither)
    product = both * neither - only_first * only_second
    return (max(product - half, 0.0) if product > 0 else product) / float(np.sqrt(rows))


def _combined(one: float, other: float, phi: float) -> float:
    return float(np.sqrt(max(0.0, one**2 - 2.0 * phi * one * other + other**2)))

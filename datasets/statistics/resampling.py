"""Intervals by resampling: of means, of differences, and of what is nested."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray

RESAMPLES = 4000
FEWEST = 5  # values below which resampling says nothing
NOTHING = 1e-100  # a variance of values that are all the same
_AT_ONCE = 4_000_000  # resampled values in memory; that many in one go for up to a thousand

Interval = tuple[float, float]


def percentiles(resampled: FloatArray) -> Interval:
    """Return the 95 % interval of resampled estimates, `(B,)`."""
    low, high = np.percentile(resampled, [2.5, 97.5]).tolist()
    return low, high


def bootstrap_mean(values: FloatArray, rng: np.random.Generator, resamples: int = 0) -> Interval:
    """Return the 95 % bootstrap interval of a mean (percentiles), however few values there are."""
    return bootstrap((values,), np.mean, False, rng, resamples)


def bootstrap(
    samples: tuple[np.ndarray, ...],
    statistic: Callable[..., FloatArray],
    paired: bool,
    rng: np.random.Generator,
    resamples: int = 0,
) -> Interval:
    """Return the 95 % bootstrap interval (percentiles) of a statistic, which takes samples and an axis."""
    count, batch = resamples or RESAMPLES, _batch(samples)
    from scipy import stats  # a recording must start at once

    found = stats.bootstrap(
        samples, statistic, n_resamples=count, batch=batch, paired=paired, method="percentile", rng=rng
    )
    return float(found.confidence_interval.low), float(found.confidence_interval.high)


def permutation_p(
    samples: tuple[np.ndarray, np.ndarray],
    statistic: Callable[..., FloatArray],
    paired: bool,
    rng: np.random.Generator,
    tests: int = 1,
) -> float:
    """Return the two-sided p of a statistic of two samples by permutation.

    Exact where there are no more than B permutations; else the smaller of #{d* ≤ d} and #{d* ≥ d}, each
    plus one, doubled, over B + 1 (Phipson & Smyth 2010).

    Args:
        samples: `(N,)` and `(M,)`; of the same trials where paired.
        statistic: Takes both samples and an axis.
        paired: Whether pairs are swapped; else values change samples.
        rng: Of the permutations.
        tests: How many there are in the family at most: B is 80 times that where it is more than
            4000, so that the smallest p is half of what Holm asks.
    """
    kind, count = "samples" if paired else "independent", max(RESAMPLES, 80 * tests)
    from scipy import stats  # a recording must start at once

    found = stats.permutation_test(
        samples, statistic, permutation_type=kind, n_resamples=count, batch=_batch(samples), rng=rng
    )
    return float(found.pvalue)


def _batch(samples: Sequence[np.ndarray]) -> int:
    """Return how many resamples of samples fit into memory."""
    return max(1, _AT_ONCE // sum(map(len, samples)))


def difference_of_means(first: FloatArray, second: FloatArray, axis: int) -> FloatArray:
    """Return the mean of one sample minus that of the other."""
    return first.mean(axis=axis) - second.mean(axis=axis)


def p_of_means(
    samples: tuple[FloatArray, FloatArray], paired: bool, rng: np.random.Generator, tests: int = 1
) -> float:
    """Return `permutation_p` of means: of their difference where paired, else of Welch's t, (ȳ₁ − ȳ₂) / s.

    s² = s₁²/n₁ + s₂²/n₂: permuted differences alone take a small group that varies more for another mean.
    Where n is small that is right only in part, so the larger one of this p and of Welch's test counts.
    Source: Chung & Romano 2013, "Exact and asymptotically robust permutation tests".
    """
    from scipy import stats  # a recording must start at once

    def welch(one: FloatArray, other: FloatArray, axis: int) -> FloatArray:
        square = sum(each.var(axis=axis, ddof=1) / each.shape[axis] for each in (one, other))
        return difference_of_means(one, other, axis) / np.sqrt(np.maximum(square, NOTHING))

    p = permutation_p(samples, difference_of_means if paired else welch, paired, rng, tests)
    if paired:
        return p
    with warnings.catch_warnings(action="ignore"):  # of a sample that does not vary
        of_t: Any = stats.ttest_ind(*samples, equal_var=False)
    return float(np.fmax(p, of_t.pvalue))


@dataclass(frozen=True)
class Run:
    """The rollouts of one trained policy."""

    draw: int  # Which draw of the dataset it was trained on
    training_seed: int  # Of its training
    seeds: tuple[int, ...]  # Of the rollouts, `(R,)`, rising
    values: FloatArray  # Success (0 or 1) or another outcome of each, `(R,)`


def resample_runs(conditions: Sequence[Sequence[Run]], rng: np.random.Generator) -> list[FloatArray]:
    """Return bootstrapped means of conditions with nested rollouts: dataset draw → training seed → rollout.

    Each level is drawn with replacement within the one above. Where every run of every condition has the same
    evaluation seeds, one draw of these serves all, so that what is paired stays so.

    Args:
        conditions: The runs of each.
        rng: Of the resampling.

    Returns:
        For each condition the means, `(B,)`; the same row is the same resampling of the evaluation seeds.
    """
    seeds = {run.seeds for runs in conditions for run in runs}
    shared = _shares(len(next(iter(seeds))), rng) if len(seeds) == 1 else None
    means = []
    for runs in conditions:
        each = [run.values @ (_shares(len(run.seeds), rng) if shared is None else shared) for run in runs]
        means.append((np.stack(each) * _weights(runs, rng)).sum(axis=0))
    return means


def _shares(count: int, rng: np.random.Generator) -> FloatArray:
    """Return how often each of `count` things is drawn, over all draws, `(count, B)`."""
    return rng.multinomial(count, np.full(count, 1.0 / count), size=RESAMPLES).T / count


def _weights(runs: Sequence[Run], rng: np.random.Generator) -> FloatArray:
    """Return the weight of each run: draws of the dataset resampled, and runs within, `(runs, B)`."""
    draws = sorted({run.draw for run in runs})
    of_draws = _shares(len(draws), rng)
    weights = np.empty((len(runs), RESAMPLES))
    for share, draw in zip(of_draws, draws, strict=True):
        places = [place for place, run in enumerate(runs) if run.draw == draw]
        weights[places] = share * _shares(len(places), rng)
    return weights

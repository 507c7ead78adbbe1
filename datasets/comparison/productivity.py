"""Successful episodes an hour of the operator's time: what a day of recording yields."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.comparison.collection import shared_seeds
from handrail.datasets.comparison.groups import Group
from handrail.datasets.statistics.resampling import FEWEST, RESAMPLES, Interval, percentiles

HOUR = 3600.0


@dataclass(frozen=True)
class RateRatio:
    """Successes an hour of a group over those of the baseline.

    Attributes:
        estimate: The ratio.
        interval: 95 %, bootstrap over episodes.
        p: Permutation test, two-sided.
    """

    estimate: float
    interval: Interval
    p: float

    @property
    def inverse(self) -> "RateRatio":
        """Those of the baseline over those of the group."""
        low, high = self.interval
        return RateRatio(_over(self.estimate), (_over(high), _over(low)), self.p)


def rate_interval(group: Group, rng: np.random.Generator) -> Interval | None:
    """Return the 95 % bootstrap interval of successes an hour; None where it cannot be told."""
    successes, seconds = _numbers(group)
    if len(successes) < FEWEST or not np.isfinite(successes).all():
        return None
    draws = rng.integers(len(successes), size=(RESAMPLES, len(successes)))
    return percentiles(_rate(successes[draws], seconds[draws]))


def rate_ratio(group: Group, baseline: Group, rng: np.random.Generator) -> RateRatio | None:
    """Return how many times as many successes an hour there are; None where it cannot be told.

    Σ success / Σ time of one over that of the other, episodes resampled, as pairs where all began alike.

    Args:
        group: One group.
        baseline: The other.
        rng: Of the resampling.
    """
    pairs = shared_seeds(group, baseline)
    numbers = [_numbers(group), _numbers(baseline)]
    if pairs:
        order, (successes, seconds) = [j for _, j in sorted(pairs)], numbers[1]
        numbers[1] = successes[order], seconds[order]
    counts = [len(successes) for successes, _ in numbers]
    if min(counts) < FEWEST or not all(np.isfinite(s).all() and s.any() for s, _ in numbers):
        return None
    draws = [rng.integers(count, size=(RESAMPLES, count)) for count in counts]
    if pairs:
        draws[1] = draws[0]
    one, other = (_rate(s[draw], t[draw]) for (s, t), draw in zip(numbers, draws, strict=True))
    ratio = np.divide(one, other, out=np.full(RESAMPLES, np.inf), where=other > 0)
    estimate = float(_rate(*numbers[0]) / _rate(*numbers[1]))
    return RateRatio(estimate, percentiles(ratio), _permutation_p(numbers, bool(pairs), rng))


def _permutation_p(
    numbers: Sequence[tuple[FloatArray, FloatArray]], paired: bool, rng: np.random.Generator
) -> float:
    """Return p of the difference of the rates: episodes change groups at random, or pairs are swapped."""
    count = len(numbers[0][0])
    successes, seconds = (np.concatenate(each) for each in zip(*numbers, strict=True))
    first = np.zeros((RESAMPLES, len(successes)), bool)
    first[:, :count] = True
    if paired:
        swapped = rng.random((RESAMPLES, count)) < 0.5
        first = np.hstack([~swapped, swapped])
    else:
        first = rng.permuted(first, axis=1)
    rates = [(which @ successes) / (which @ seconds) for which in (first, ~first)]
    observed = _rate(*numbers[0]) - _rate(*numbers[1])
    extreme = np.abs(HOUR * (rates[0] - rates[1])) >= abs(observed) * (1.0 - 1e-12)
    return float((1 + np.count_nonzero(extreme)) / (RESAMPLES + 1))


def _numbers(group: Group) -> tuple[FloatArray, FloatArray]:
    """Return success, NaN where unknown, and duration [s] of every episode."""
    successes = [np.nan if e.success is None else float(e.success) for e in group.episodes]
    return np.array(successes), np.array([e.seconds for e in group.episodes])


def _over(ratio: float) -> float:
    return 1.0 / ratio if ratio else float("inf")


def _rate(successes: FloatArray, seconds: FloatArray) -> FloatArray:
    return HOUR * successes.sum(axis=-1) / seconds.sum(axis=-1)

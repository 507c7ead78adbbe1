"""From a few trained policies to all that could be trained: Student's and Welch's t over replicates.

A replicate is what was drawn anew: a draw of the dataset with all its policies where there are several, else
a training seed. Few replicates may agree by chance, so each varies at least as its own rollouts do.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy import stats

from handrail.controllers.arrays import FloatArray
from handrail.datasets.statistics.contrast import LEVEL, Estimate
from handrail.datasets.statistics.resampling import Interval, Run

_SUCCESSES, _TRIALS = 2.0, 4.0  # added, so that a share is never quite 0 or 1 (Agresti and Coull)

Chance = Callable[[Sequence[Run]], float]


def chance_of_shares(runs: Sequence[Run]) -> float:
    """Return the variance of one replicate's share if only its rollouts were drawn.

    p (1 − p) / R with p = (s + 2) / (n + 4) of s successes in n rollouts, R of a replicate.
    """
    values = np.concatenate([run.values for run in runs])
    share = (values.sum() + _SUCCESSES) / (len(values) + _TRIALS)
    return float(share * (1.0 - share) / (len(values) / len(replicates(runs))))


def chance_of_means(runs: Sequence[Run]) -> float:
    """Return the variance of one replicate's mean if only its rollouts were drawn: s² / R."""
    values = np.concatenate([run.values for run in runs])
    return float(values.var() * len(replicates(runs)) / len(values))


def replicates(runs: Sequence[Run]) -> FloatArray:
    """Return a number for each replicate: the mean over its policies of the means over their rollouts."""
    draws = [run.draw for run in runs]
    keys = draws if len(set(draws)) > 1 else range(len(runs))
    members: dict[int, list[float]] = {}
    for key, run in zip(keys, runs, strict=True):
        members.setdefault(key, []).append(float(run.values.mean()))
    return np.array([np.mean(each) for each in members.values()])


def standard_error(
    conditions: Sequence[Sequence[Run]], chance: Chance = chance_of_shares
) -> tuple[float, float]:
    """Return the standard error of a mean, or of the difference of two, and its degrees of freedom.

    √Σ v with v = max(s², chance) / n of n replicates, and (Σ v)² / Σ v² / (n − 1): Welch and Satterthwaite.
    0 and ∞ where nothing varies at all, not even rollouts.

    Args:
        conditions: The runs of one condition or of two, with two replicates each or more.
        chance: By how much a replicate varies at least.
    """
    parts, freedom = [], []
    for runs in conditions:
        means = replicates(runs)
        parts.append(max(float(means.var(ddof=1)), chance(runs)) / len(means))
        freedom.append(len(means) - 1)
    total = sum(parts)
    if not total:
        return 0.0, float("inf")
    return float(np.sqrt(total)), total**2 / sum(v**2 / n for v, n in zip(parts, freedom, strict=True))


def t_interval(estimate: float, error: float, freedom: float) -> Interval:
    """Return the 95 % interval of an estimate by Student's t."""
    half = float(stats.t.ppf(0.975, freedom)) * error
    return estimate - half, estimate + half


def wider(one: Interval, other: Interval, low: float, high: float) -> Interval:
    """Return the interval that holds both, within bounds that cannot be left."""
    return max(low, min(one[0], other[0])), min(high, max(one[1], other[1]))


def welch_p(first: Sequence[Run], second: Sequence[Run]) -> float:
    """Return the two-sided p of Welch's t test of the success of replicates; never 0."""
    error, freedom = standard_error((first, second))
    difference = float(replicates(first).mean() - replicates(second).mean())
    return 2.0 * float(stats.t.sf(abs(difference) / error, freedom))


def student(values: FloatArray | Sequence[float], least: float) -> Estimate:
    """Return the mean of replicates, with error √(max(s², v) / n) and n − 1 degrees of freedom.

    Args:
        values: of each replicate, `(n,)`.
        least: v, the variance that a replicate has at least: a few may agree by chance.
    """
    values = np.asarray(values, float)
    mean, count = float(values.mean()), len(values)
    if count < 2:
        return Estimate(estimate=mean, counts=(count,))
    error = float(np.sqrt(max(float(values.var(ddof=1)), least) / count))
    p = 2.0 * float(stats.t.sf(abs(mean) / error, count - 1)) if error else float(mean == 0.0)
    interval = t_interval(mean, error, count - 1)
    return Estimate(
        estimate=mean, interval=interval, p=p, counts=(count,), errors=((error, count - 1),), paired=True
    )


def equivalence_p(found: Estimate, margin: float) -> float | None:
    """Return the larger p of two one-sided t tests that a difference is nearer to 0 than a margin (TOST).

    `P(T > (margin − |d|) / s)`: Schuirmann 1987. None where no error is known.
    """
    if not found.errors or found.estimate is None:
        return None
    error, freedom = found.errors[0]
    return float(stats.t.sf((margin - abs(found.estimate)) / error, freedom))


def equivalence_power(margin: float, error: float, freedom: float) -> float:
    """Return how often `equivalence_p` is below 0.05 where there is no difference.

    `2 F(margin / s − t_0.95) − 1`, F of Student's t: approximately, as s is taken for known.
    """
    beyond = margin / error - float(stats.t.ppf(1.0 - LEVEL, freedom))
    return max(0.0, 2.0 * float(stats.t.cdf(beyond, freedom)) - 1.0)

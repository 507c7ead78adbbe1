"""What replicates say of a mean: Student's t, where a replicate varies at least as its own rollouts do."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from handrail.controllers.arrays import FloatArray
from handrail.datasets.statistics.proportions import reach
from handrail.datasets.statistics.replicates import t_interval
from handrail.datasets.statistics.resampling import Interval


@dataclass(frozen=True)
class Estimate:
    """A mean over replicates.

    Attributes:
        value: the mean.
        replicates: how many, n.
        error: its standard error; None for one replicate.
        interval: 95 %; None for one replicate.
        p: two-sided, of a mean of 0; None for one replicate.
    """

    value: float
    replicates: int
    error: float | None = None
    interval: Interval | None = None
    p: float | None = None

    def detectable(self, tests: int = 1) -> float | None:
        """Return the mean that would be detected in 80 % of such experiments, Holm over tests."""
        return None if self.error is None else reach(tests, self.replicates - 1) * self.error


def student(values: FloatArray | Sequence[float], least: float) -> Estimate:
    """Return the mean of replicates, with error √(max(s², v) / n) and n − 1 degrees of freedom.

    Args:
        values: of each replicate, `(n,)`.
        least: v, the variance that a replicate has at least: a few may agree by chance.
    """
    values = np.asarray(values, float)
    mean, count = float(values.mean()), len(values)
    if count < 2:
        return Estimate(mean, count)
    error = float(np.sqrt(max(float(values.var(ddof=1)), least) / count))
    p = 2.0 * float(stats.t.sf(abs(mean) / error, count - 1)) if error else float(mean == 0.0)
    return Estimate(mean, count, error, t_interval(mean, error, count - 1), p)


def variance_of_share(successes: float, trials: int, each: int) -> float:
    """Return the variance of a share of so many trials `each`, p (1 − p) / R, p = (s + 2) / (n + 4).

    Args:
        successes: s of all trials.
        trials: n, all.
        each: R, of one replicate.
    """
    share = (successes + 2.0) / (trials + 4.0)
    return share * (1.0 - share) / each

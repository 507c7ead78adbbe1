"""Shares of successes and how they differ: intervals and exact tests, after Newcombe 1998.

Newcombe, "Interval estimation for the difference between independent proportions" (Statistics in Medicine 17,
873–890) and "Improved confidence intervals for the difference between binomial proportions based on paired
data" (2635–2650), method 10 of each.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from handrail.datasets.paired import paired_success, wilson

Interval = tuple[float, float]
POWER = 0.8
_REACH = float(stats.norm.ppf(0.975) + stats.norm.ppf(POWER))


@dataclass(frozen=True)
class ShareDifference:
    """How two shares differ, first minus second.

    Attributes:
        estimate: Of the difference, −1 to 1.
        interval: 95 %, Newcombe's method 10.
        p: Two-sided, exact: McNemar's where paired, else Boschloo's.
        paired: Whether the same trials were made under both.
        trials: Pairs, or trials of the first and of the second.
        detectable: The difference that would be seen as one in 80 % of such experiments.
    """

    estimate: float
    interval: Interval
    p: float
    paired: bool
    trials: tuple[int, ...]
    detectable: float


def paired_difference(first: Sequence[bool], second: Sequence[bool]) -> ShareDifference:
    """Compare successes of the same trials under two conditions, `(N,)` each.

    Raises:
        HandrailError: The sizes differ, or there are none.
    """
    found = paired_success(np.asarray(first), np.asarray(second))
    both = int(np.sum(np.asarray(first, bool) & np.asarray(second, bool)))
    neither = found.pairs - both - found.only_first - found.only_second
    cells = (both, found.only_first, found.only_second, neither)
    discordant = (found.only_first + found.only_second + 2) / (found.pairs + 4)
    return ShareDifference(
        estimate=(found.only_first - found.only_second) / found.pairs,
        interval=newcombe_paired(*cells),
        p=found.p_mcnemar,
        paired=True,
        trials=(found.pairs,),
        detectable=min(1.0, _REACH * float(np.sqrt(discordant / found.pairs))),
    )


def unpaired_difference(first: Sequence[bool], second: Sequence[bool]) -> ShareDifference:
    """Compare successes of different trials under two conditions, `(N,)` and `(M,)`.

    Raises:
        HandrailError: There are none.
    """
    one, other = (int(np.sum(first)), len(first)), (int(np.sum(second)), len(second))
    interval = newcombe_unpaired(*one, *other)
    table = [[one[0], other[0]], [one[1] - one[0], other[1] - other[0]]]
    share = (one[0] + other[0] + 2) / (one[1] + other[1] + 4)
    spread = np.sqrt(share * (1 - share) * (1 / one[1] + 1 / other[1]))
    return ShareDifference(
        estimate=one[0] / one[1] - other[0] / other[1],
        interval=interval,
        p=float(stats.boschloo_exact(table).pvalue),
        paired=False,
        trials=(one[1], other[1]),
        detectable=min(1.0, _REACH * float(spread)),
    )


def newcombe_paired(both: int, only_first: int, only_second: int, neither: int) -> Interval:
    """Return the 95 % interval of the difference of two paired shares (method 10).

    The Wilson intervals of the two shares, combined as squares with their correlation φ̂ taken off; the
    numerator of φ̂ is brought nearer to zero by n/2 where it is positive.

    Args:
        both: Pairs that succeeded twice.
        only_first: That succeeded under the first condition only.
        only_second: Under the second only.
        neither: Under none.

    Raises:
        HandrailError: There are no pairs.
    """
    count = both + only_first + only_second + neither
    low_1, high_1 = wilson(both + only_first, count)
    low_2, high_2 = wilson(both + only_second, count)
    share_1, share_2 = (both + only_first) / count, (both + only_second) / count
    phi = _correlation(both, only_first, only_second, neither)
    below, above = (share_1 - low_1, high_2 - share_2), (high_1 - share_1, share_2 - low_2)
    difference = share_1 - share_2
    return difference - _combined(*below, phi), difference + _combined(*above, phi)


def newcombe_unpaired(successes_1: int, trials_1: int, successes_2: int, trials_2: int) -> Interval:
    """Return the 95 % interval of the difference of two independent shares (method 10).

    Raises:
        HandrailError: No trials, or more successes than trials.
    """
    low_1, high_1 = wilson(successes_1, trials_1)
    low_2, high_2 = wilson(successes_2, trials_2)
    share_1, share_2 = successes_1 / trials_1, successes_2 / trials_2
    difference = share_1 - share_2
    return (
        difference - _combined(share_1 - low_1, high_2 - share_2, 0.0),
        difference + _combined(high_1 - share_1, share_2 - low_2, 0.0),
    )


def holm(p: Sequence[float]) -> list[float]:
    """Return p-values adjusted for there being several (Holm 1979): p'_(i) = max_{j ≤ i} (m − j + 1) p_(j).

    Args:
        p: `(m,)`.

    Returns:
        In the same order, at most 1.
    """
    order = np.argsort(p)
    steps = np.arange(len(p), 0, -1) * np.asarray(p, float)[order]
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(steps))
    return adjusted.tolist()


def _correlation(both: int, only_first: int, only_second: int, neither: int) -> float:
    rows = (both + only_first) * (only_second + neither) * (both + only_second) * (only_first + neither)
    if not rows:
        return 0.0
    half = 0.5 * (both + only_first + only_second + neither)
    product = both * neither - only_first * only_second
    return (max(product - half, 0.0) if product > 0 else product) / float(np.sqrt(rows))


def _combined(one: float, other: float, phi: float) -> float:
    return float(np.sqrt(max(0.0, one**2 - 2.0 * phi * one * other + other**2)))

"""The collected data: how many episodes, in how much of an operator's time, and the yield of that time."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.comparison.groups import Group
from handrail.datasets.statistics.contrast import RATIO, SHARE, Contrast, Measure, Value
from handrail.datasets.statistics.paired import wilson
from handrail.datasets.statistics.proportions import paired_shares, unpaired_shares
from handrail.datasets.statistics.resampling import FEWEST, NOTHING, bootstrap, permutation_p

COLLECTING = "collecting"
SUCCESS = Measure("success", "success while collecting", SHARE)
HOURLY = Measure("successes_an_hour", "successes an operator hour", RATIO)
_UNKNOWN = "success was not recorded for all"


def collected(group: Group, scope: str, rng: np.random.Generator | None = None) -> list[Value]:
    """Return success and successes an hour of a group; `rng` resamples episodes for the interval of these."""
    names: dict[str, Any] = {"label": group.label, "scope": scope}
    count, seconds = len(group.episodes), group.seconds
    if (successes := group.successes) is None:
        return [Value(measure=each, **names, reason=_UNKNOWN) for each in (SUCCESS, HOURLY)]
    names["counts"] = (count,)
    likely = bootstrap(_numbers(group), _rate, True, rng) if rng and count >= FEWEST else None
    return [
        Value(measure=SUCCESS, **names, estimate=successes / count, interval=wilson(successes, count)),
        Value(measure=HOURLY, **names, estimate=3600.0 * successes / seconds, interval=likely),
    ]


def shared_seeds(one: Group, other: Group) -> list[tuple[int, int]]:
    """Return places of episodes with the same start, as pairs; none unless every episode has its pair.

    Two episodes begin alike if task sentences and seed are the same. Seeds must be unique in each group. With
    only some of them paired, what is compared would not be what is shown.
    """
    starts, others = _starts(one), _starts(other)
    if len(one.episodes) < 2 or starts.keys() != others.keys():
        return []
    return [(place, others[key]) for key, place in starts.items()]


def _starts(group: Group) -> dict[tuple[str, int], int]:
    known = [(str(e.meta.get("tasks")), e.meta.get("seed")) for e in group.episodes]
    keys = [(task, seed) for task, seed in known if isinstance(seed, int)]
    if len(set(keys)) < len(known):
        return {}
    return {key: place for place, key in enumerate(keys)}


def success_difference(group: Group, baseline: Group) -> Contrast:
    """Return how success in collection differs from the baseline's."""
    names = _names(SUCCESS, group, baseline)
    if None in (group.successes, baseline.successes):
        return Contrast(**names, reason=_UNKNOWN)
    one, other = ([bool(episode.success) for episode in each.episodes] for each in (group, baseline))
    if pairs := shared_seeds(group, baseline):
        found = paired_shares([one[i] for i, _ in pairs], [other[j] for _, j in pairs])
    else:
        found = unpaired_shares(one, other)
    return Contrast(**names, **vars(found))


def _names(measure: Measure, group: Group, baseline: Group) -> dict[str, Any]:
    names = {"measure": measure, "label": group.label, "baseline": baseline.label}
    return names | {"scope": COLLECTING, "family": measure.title}


def matched_number(groups: Sequence[Group]) -> list[Group]:
    """Return the first episodes of each group, as many as the smallest has."""
    count = min(len(group.episodes) for group in groups)
    return [group.first(count) for group in groups]


def matched_time(groups: Sequence[Group]) -> list[Group]:
    """Return the first episodes of each group that fit into the shortest group's operator time."""
    seconds = min(group.seconds for group in groups)
    return [group.within(seconds) for group in groups]


def rate_ratio(group: Group, baseline: Group, rng: np.random.Generator) -> Contrast:
    """Return how many times as many successes an hour there are.

    Σ success / Σ time of one over that of the other, episodes resampled, as pairs where all began alike. Else
    p is of the difference in standard errors: permuted differences alone take the smaller group for another.
    """
    names = _names(HOURLY, group, baseline)
    pairs, counts = shared_seeds(group, baseline), (len(group.episodes), len(baseline.episodes))
    numbers = [_numbers(group), _numbers(baseline)]
    if min(counts) < FEWEST or not all(np.isfinite(s).all() and s.any() for s, _ in numbers):
        return Contrast(**names, null=1.0, reason="too few episodes, or none that is known to have succeeded")
    successes, seconds = (np.concatenate(each) for each in zip(*numbers, strict=True))
    places = np.arange(counts[0]), counts[0] + np.arange(counts[1])
    if pairs:
        places = np.array([i for i, _ in pairs]), counts[0] + np.array([j for _, j in pairs])

    def rates(*chosen: IntArray, axis: int = -1) -> list[FloatArray]:
        return [_rate(successes[each], seconds[each], axis) for each in chosen]

    def share(*chosen: IntArray, axis: int = -1) -> FloatArray:
        one, other = rates(*chosen, axis=axis)
        return np.divide(one, one + other, out=np.full_like(one, 0.5), where=one + other > 0)

    def apart(*chosen: IntArray, axis: int = -1) -> FloatArray:
        one, other = rates(*chosen, axis=axis)
        if pairs:
            return one - other
        square = sum(_square(successes[each], seconds[each], axis) for each in chosen)
        return (one - other) / np.sqrt(np.maximum(square, NOTHING))

    low, high = bootstrap(places, share, bool(pairs), rng)  # of both, which is finite even without successes
    one, other = rates(*places)
    return Contrast(
        **names,
        null=1.0,
        estimate=float(one / other),
        interval=(low * _over(1.0 - low), high * _over(1.0 - high)),
        p=permutation_p(places, apart, bool(pairs), rng),
        counts=counts,
        paired=bool(pairs),
    )


def _numbers(group: Group) -> tuple[FloatArray, FloatArray]:
    """Return success, NaN where it is not known, and duration [s] of every episode."""
    successes = [np.nan if e.success is None else float(e.success) for e in group.episodes]
    return np.array(successes), np.array([e.seconds for e in group.episodes])


def _square(successes: FloatArray, seconds: FloatArray, axis: int) -> FloatArray:
    """Return the squared standard error of a rate, `n / (n − 1) Σ (s_i − R t_i)² / (Σ t)²` [1/h²]."""
    rate = np.expand_dims(_rate(successes, seconds, axis) / 3600.0, axis)
    count, away = successes.shape[axis], successes - rate * seconds
    return count / (count - 1) * (away**2).sum(axis=axis) * (3600.0 / seconds.sum(axis=axis)) ** 2


def _over(ratio: float) -> float:
    return 1.0 / ratio if ratio else float("inf")


def _rate(successes: FloatArray, seconds: FloatArray, axis: int = -1) -> FloatArray:
    return 3600.0 * successes.sum(axis=axis) / seconds.sum(axis=axis)

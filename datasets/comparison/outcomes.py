"""How policies trained on the datasets fared, and how sure that is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.comparison.evaluations import SUCCESS, Condition
from handrail.datasets.statistics.paired import wilson
from handrail.datasets.statistics.proportions import (
    ShareDifference,
    holm,
    independent_trials,
    paired_shares,
    reach,
    unpaired_shares,
)
from handrail.datasets.statistics.replicates import (
    chance_of_means,
    replicates,
    standard_error,
    t_interval,
    welch_p,
    wider,
)
from handrail.datasets.statistics.resampling import Interval, Run, percentiles, resample_runs

LIKE_FOR_LIKE = "like-for-like"


@dataclass(frozen=True)
class ConditionOutcome:
    """One condition.

    Attributes:
        label: Its name.
        successes: Of all rollouts.
        rollouts: Their number.
        wilson: 95 % interval of the success of these very policies: Wilson's, of as many rollouts as those of
            several policies in the same scenes are worth.
        nested: 95 % interval over dataset draw, training seed and evaluation seed: the wider of the nested
            bootstrap's and Student's over replicates; None for one replicate.
        seeds: Success of each trained policy, one after the other.
        draws: Number of draws of the dataset.
        means: Mean of every other outcome a rollout, by name, and its 95 % interval, as `nested` is.
        trained_on: What the first policy was trained on.
    """

    label: str
    successes: int
    rollouts: int
    wilson: Interval
    nested: Interval | None
    seeds: tuple[float, ...]
    draws: int
    means: Mapping[str, tuple[float, Interval]]
    trained_on: Mapping[str, float]

    @property
    def share(self) -> float:
        """Success over all rollouts."""
        return self.successes / self.rollouts


@dataclass(frozen=True)
class Pair:
    """Labels of a condition and of what it is compared with, and which family of comparisons that belongs to.

    A family is declared by the kind of comparison before anything is known of its result: Holm's correction
    is over all of one family, and the report names it.
    """

    label: str
    baseline: str
    family: str = LIKE_FOR_LIKE


@dataclass(frozen=True)
class OutcomeDifference:
    """Success of a condition minus that of the baseline.

    Attributes:
        label: The condition.
        baseline: The other one.
        rollouts: Over all rollouts, as if these policies were all there is.
        family: What kind of comparison it is: p is adjusted over all of this kind.
        nested: 95 % interval over dataset draw, training seed and evaluation seed, the wider of the nested
            bootstrap's and Welch's t interval over replicates; None where a condition has only one replicate,
            since then nothing is known of how much the training seed matters.
        p: Two-sided, the largest of the exact test's, the nested bootstrap's, and Welch's t test of the
            replicates' success; resampling a handful of training seeds alone would see too much.
        p_adjusted: By Holm, over all differences of the family.
        tests: Number of differences in the family.
        training_error: Standard error over the replicates, and its degrees of freedom, as Welch has them;
            None where a condition has only one replicate.
        detectable: The difference that would be seen as one in 80 % of such experiments.
    """

    label: str
    baseline: str
    family: str
    rollouts: ShareDifference
    nested: Interval | None
    p: float
    p_adjusted: float
    tests: int
    training_error: tuple[float, float] | None
    detectable: float

    @property
    def detected(self) -> bool:
        """Whether all intervals leave zero out and the adjusted p is below 0.05."""
        intervals = [self.rollouts.interval, *([self.nested] if self.nested else [])]
        return self.p_adjusted < 0.05 and all(low > 0 or high < 0 for low, high in intervals)


@dataclass(frozen=True)
class Outcomes:
    """All conditions, and each against the baseline."""

    conditions: tuple[ConditionOutcome, ...]
    differences: tuple[OutcomeDifference, ...]


def judge_pairs(
    conditions: Mapping[str, Condition], pairs: Sequence[Pair], rng: np.random.Generator
) -> Outcomes:
    """Compare the success of conditions, each with a baseline of its own, family by family.

    Args:
        conditions: By label.
        pairs: What is compared with what.
        rng: Of the resampling.
    """
    runs = {label: condition.runs() for label, condition in conditions.items()}
    resampled = dict(zip(runs, resample_runs(list(runs.values()), rng), strict=True))
    found = tuple(_condition(condition, resampled[label], rng) for label, condition in conditions.items())
    return Outcomes(found, in_families([_difference(pair, runs, resampled) for pair in pairs]))


def in_families(differences: Sequence[OutcomeDifference]) -> tuple[OutcomeDifference, ...]:
    """Return differences with p adjusted by Holm for all of their family, and what is detectable then."""
    members: dict[str, list[int]] = {}
    for place, difference in enumerate(differences):
        members.setdefault(difference.family, []).append(place)
    found = list(differences)
    for places in members.values():
        adjusted, tests = holm([differences[place].p for place in places]), len(places)
        for place, p in zip(places, adjusted, strict=True):
            each = differences[place]
            found[place] = replace(each, p_adjusted=p, tests=tests, detectable=_detectable(each, tests))
    return tuple(found)


def _detectable(difference: OutcomeDifference, tests: int) -> float:
    """Return what both the test of the rollouts and that of the trained policies would see."""
    found = difference.rollouts.detectable(tests)
    if difference.training_error:
        error, freedom = difference.training_error
        found = max(found, reach(tests, freedom) * error)
    return min(1.0, found)


def _condition(condition: Condition, resampled: FloatArray, rng: np.random.Generator) -> ConditionOutcome:
    runs = condition.runs()
    values = np.concatenate([run.values for run in runs])
    worth = independent_trials(values, [seed for run in runs for seed in run.seeds])
    names = [name for name in condition.outcomes if name != SUCCESS]
    return ConditionOutcome(
        label=condition.label,
        successes=int(values.sum()),
        rollouts=len(values),
        wilson=wilson(float(values.mean()) * worth, worth),
        nested=_nested(runs, resampled),
        seeds=tuple(float(run.values.mean()) for run in runs),
        draws=len({run.draw for run in runs}),
        means={name: _mean(condition.runs(name), rng) for name in names},
        trained_on=condition.policies[0].trained_on,
    )


def _nested(runs: Sequence[Run], resampled: FloatArray) -> Interval | None:
    means = replicates(runs)
    if len(means) < 2:
        return None
    return wider(percentiles(resampled), t_interval(float(means.mean()), *standard_error([runs])), 0.0, 1.0)


def _mean(runs: Sequence[Run], rng: np.random.Generator) -> tuple[float, Interval]:
    (resampled,) = resample_runs([runs], rng)
    values, means = np.concatenate([run.values for run in runs]), replicates(runs)
    interval = percentiles(resampled)
    if len(means) > 1:
        by_t = t_interval(float(means.mean()), *standard_error([runs], chance_of_means))
        interval = wider(interval, by_t, 0.0 if values.min() >= 0.0 else -np.inf, np.inf)
    return float(values.mean()), interval


def _difference(
    pair: Pair, runs: Mapping[str, Sequence[Run]], resampled: Mapping[str, FloatArray]
) -> OutcomeDifference:
    both = runs[pair.label], runs[pair.baseline]
    names, shares = (pair.label, pair.baseline, pair.family), compare_rollouts(*both)
    if min(len(replicates(each)) for each in both) < 2:
        return OutcomeDifference(*names, shares, None, shares.p, shares.p, 1, None, 1.0)
    nested = resampled[pair.label] - resampled[pair.baseline]
    tail = (1 + min(np.count_nonzero(nested <= 0), np.count_nonzero(nested >= 0))) / (len(nested) + 1)
    p = max(shares.p, min(1.0, 2.0 * float(tail)), welch_p(*both))
    error, freedom = standard_error(both)
    estimate = float(replicates(both[0]).mean() - replicates(both[1]).mean())
    interval = wider(percentiles(nested), t_interval(estimate, error, freedom), -1.0, 1.0)
    return OutcomeDifference(*names, shares, interval, p, p, 1, (error, freedom), 1.0)


def compare_rollouts(first: Sequence[Run], second: Sequence[Run]) -> ShareDifference:
    """Compare all rollouts of two conditions, as pairs where training and evaluation seeds are the same."""
    one, other = _rollouts(first), _rollouts(second)
    scenes = [seed for *_, seed in one], [seed for *_, seed in other]
    if one.keys() == other.keys():
        return paired_shares([one[key] for key in one], [other[key] for key in one], scenes[0])
    return unpaired_shares(list(one.values()), list(other.values()), scenes)


def _rollouts(runs: Sequence[Run]) -> dict[tuple[int, int, int], bool]:
    return {
        (run.draw, run.training_seed, seed): bool(value)
        for run in runs
        for seed, value in zip(run.seeds, run.values, strict=True)
    }

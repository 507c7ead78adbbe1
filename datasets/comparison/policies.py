"""How policies trained on the datasets fared, and how sure that is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.evaluations import SUCCESS, Condition
from handrail.datasets.comparison.groups import group_of
from handrail.datasets.statistics.contrast import SHARE, Contrast, Estimate, Measure, adjusted
from handrail.datasets.statistics.paired import wilson
from handrail.datasets.statistics.proportions import independent_trials, paired_shares, unpaired_shares
from handrail.datasets.statistics.replicates import (
    chance_of_means,
    replicates,
    standard_error,
    t_interval,
    welch_p,
    wider,
)
from handrail.datasets.statistics.resampling import Interval, Run, percentiles, resample_runs

LIKE_FOR_LIKE, MIXED = "like-for-like", "mixed"  # families: mixed policies differ in more than their data
POLICIES = "policies"
POLICY_SUCCESS = Measure("policy_success", "success of policies", SHARE, "higher", "share of rollouts")


@dataclass(frozen=True)
class ConditionOutcome:
    """The numbers of one condition."""

    label: str
    successes: int
    rollouts: int
    wilson: Interval
    """95 % for these very policies, of as many rollouts as those in the same scenes are worth."""
    nested: Interval | None
    """95 % over dataset draw, training seed and evaluation seed: the wider of the nested bootstrap's and
    Student's over replicates; None for one replicate."""
    seeds: tuple[float, ...]  # success of each trained policy
    draws: int  # of the dataset
    means: Mapping[str, tuple[float, Interval]]  # of every other outcome; intervals are as `nested`
    trained_on: Mapping[str, float]  # of the first policy

    @property
    def share(self) -> float:
        """Success over all rollouts."""
        return self.successes / self.rollouts


@dataclass(frozen=True)
class Pair:
    """Labels of a condition and of what it is compared with, and the family of comparisons."""

    label: str
    baseline: str
    family: str = LIKE_FOR_LIKE


@dataclass(frozen=True)
class Outcomes:
    """All conditions, and each against its baseline."""

    conditions: tuple[ConditionOutcome, ...]
    differences: tuple[Contrast, ...]


def pairs_between(conditions: Sequence[str], baseline: str, labels: Sequence[str]) -> list[Pair]:
    """Return each condition of another group with that of the baseline's group it is compared with.

    That is the one that shares most of the words after the label and has none of its own: `ee intent same
    number` is set against `direct same number`, not `direct`. Like for like are those with the same words. A
    single condition is compared with nothing.
    """
    words = {
        condition: set(condition.removeprefix(group_of(condition, labels)).strip(" /").split())
        for condition in conditions
    }
    candidates = [condition for condition in conditions if group_of(condition, labels) == baseline]
    found = []
    for condition in conditions if len(conditions) > 1 else ():
        if condition in candidates:
            continue
        fitting = [each for each in candidates if words[each] <= words[condition]]
        if not fitting:
            raise HandrailError(
                f"evaluations: expected a condition {baseline!r} to compare {condition!r} with, got "
                f"{', '.join(conditions)}; name another --baseline"
            )
        other = max(fitting, key=lambda each: len(words[each]))
        found.append(Pair(condition, other, LIKE_FOR_LIKE if words[other] == words[condition] else MIXED))
    return found


def judge_pairs(
    conditions: Mapping[str, Condition], pairs: Sequence[Pair], rng: np.random.Generator
) -> Outcomes:
    """Compare the success of conditions, each with a baseline of its own, family by family."""
    runs = {label: condition.runs() for label, condition in conditions.items()}
    resampled = dict(zip(runs, resample_runs(list(runs.values()), rng), strict=True))
    found = tuple(_condition(condition, resampled[label], rng) for label, condition in conditions.items())
    return Outcomes(found, tuple(adjusted(_difference(pair, runs, resampled) for pair in pairs)))


def _condition(condition: Condition, resampled: FloatArray, rng: np.random.Generator) -> ConditionOutcome:
    runs = condition.runs()
    values, means = np.concatenate([run.values for run in runs]), replicates(runs)
    worth, nested = independent_trials(values, [seed for run in runs for seed in run.seeds]), None
    if len(means) > 1:
        by_t = t_interval(float(means.mean()), *standard_error([runs]))
        nested = wider(percentiles(resampled), by_t, 0.0, 1.0)
    return ConditionOutcome(
        label=condition.label,
        successes=int(values.sum()),
        rollouts=len(values),
        wilson=wilson(float(values.mean()) * worth, worth),
        nested=nested,
        seeds=tuple(float(run.values.mean()) for run in runs),
        draws=len({run.draw for run in runs}),
        means={name: _mean(condition.runs(name), rng) for name in condition.outcomes if name != SUCCESS},
        trained_on=condition.policies[0].trained_on,
    )


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
) -> Contrast:
    """Compare two conditions.

    `interval` is over all rollouts, as if these policies were all there is; `nested` over dataset draw,
    training seed and evaluation seed, the wider of the nested bootstrap's and Welch's t interval over
    replicates; None where a condition has one replicate. p is the largest of the exact test's, the nested
    bootstrap's, and Welch's: resampling a handful of training seeds alone would see too much.
    """
    both = runs[pair.label], runs[pair.baseline]
    names = {"measure": POLICY_SUCCESS, "scope": POLICIES}
    found = Contrast(**vars(pair), **names, **vars(compare_rollouts(*both)))
    if min(len(replicates(each)) for each in both) < 2:
        return found
    nested = resampled[pair.label] - resampled[pair.baseline]
    tail = (1 + min(np.count_nonzero(nested <= 0), np.count_nonzero(nested >= 0))) / (len(nested) + 1)
    error, freedom = standard_error(both)
    estimate = float(replicates(both[0]).mean() - replicates(both[1]).mean())
    return replace(
        found,
        nested=wider(percentiles(nested), t_interval(estimate, error, freedom), -1.0, 1.0),
        p=max(found.p or 0.0, min(1.0, 2.0 * float(tail)), welch_p(*both)),
        errors=(*found.errors, (error, freedom)),
    )


def compare_rollouts(first: Sequence[Run], second: Sequence[Run]) -> Estimate:
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

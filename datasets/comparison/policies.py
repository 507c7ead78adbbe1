"""How policies trained on the datasets fared, and how sure that is."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.evaluations import SUCCESS, Condition
from handrail.datasets.comparison.groups import group_of
from handrail.datasets.statistics.contrast import SHARE, Contrast, Estimate, Measure, Value, adjusted
from handrail.datasets.statistics.paired import wilson
from handrail.datasets.statistics.proportions import independent_trials, paired_shares, unpaired_shares
from handrail.datasets.statistics.replicates import (
    chance_of_means,
    chance_of_shares,
    replicates,
    standard_error,
    t_interval,
    welch_p,
    wider,
)
from handrail.datasets.statistics.resampling import Run, percentiles, resample_runs

LIKE_FOR_LIKE, MIXED = "like-for-like", "mixed"  # families: mixed policies differ in more than their data
POLICIES = "policies"
_ALONE = "not tested: one policy of a condition says nothing of other trainings"
POLICY_SUCCESS = Measure("policy_success", "success of policies", SHARE, "higher", "share of rollouts")


@dataclass(frozen=True)
class Outcomes:
    """How policies fared, and each condition against its baseline."""

    conditions: Mapping[str, Condition]
    values: Sequence[Value]  # success, then the other outcomes, of each condition
    differences: Sequence[Contrast]

    @property
    def successes(self) -> dict[str, Value]:
        """Success by condition."""
        return {each.label: each for each in self.values if each.measure is POLICY_SUCCESS}


def pairs_between(conditions: Sequence[str], baseline: str, labels: Sequence[str]) -> list[Contrast]:
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
        found.append(pair(condition, other, LIKE_FOR_LIKE if words[other] == words[condition] else MIXED))
    return found


def pair(label: str, baseline: str, family: str = LIKE_FOR_LIKE) -> Contrast:
    """Return the contrast of a condition and what it is compared with, before anything is known of it."""
    return Contrast(measure=POLICY_SUCCESS, label=label, baseline=baseline, scope=POLICIES, family=family)


def judge_pairs(
    conditions: Mapping[str, Condition], pairs: Sequence[Contrast], rng: np.random.Generator
) -> Outcomes:
    """Compare the success of conditions, each with a baseline of its own, family by family."""
    runs = {label: condition.runs() for label, condition in conditions.items()}
    resampled = dict(zip(runs, resample_runs(list(runs.values()), rng), strict=True))
    values = [each for label, one in conditions.items() for each in _values(one, resampled[label], rng)]
    found = [_difference(pair, runs, resampled) for pair in pairs]
    return Outcomes(conditions, values, adjusted(found))


def _values(condition: Condition, resampled: FloatArray, rng: np.random.Generator) -> Iterator[Value]:
    """Yield success and the other outcomes: means over replicates, however many rollouts each has.

    `interval` of the success is Wilson's for these very policies, of as many rollouts as those in the same
    scenes are worth. `nested` is over dataset draw, training seed and evaluation seed: the wider of the
    nested bootstrap's and Student's over replicates; None for one replicate, whose other outcomes have the
    bootstrap's over its rollouts as `interval`.
    """
    for name in condition.outcomes:
        runs, success = condition.runs(name), name == SUCCESS
        values, means = np.concatenate([run.values for run in runs]), replicates(runs)
        estimate = float(means.mean())
        nested = percentiles(resampled if success else resample_runs([runs], rng)[0])
        if len(means) > 1:
            error = standard_error([runs], chance_of_shares if success else chance_of_means)
            low = 0.0 if success or values.min() >= 0.0 else -np.inf
            by_t = t_interval(estimate, *error)
            nested = wider(nested, by_t, low, 1.0 if success else np.inf)
        worth = independent_trials(values, [seed for run in runs for seed in run.seeds]) if success else 0.0
        yield Value(
            measure=POLICY_SUCCESS if success else Measure(name, name),
            label=condition.label,
            scope=POLICIES,
            values=np.array([run.values.mean() for run in runs]),
            estimate=estimate,
            interval=wilson(estimate * worth, worth) if success else None if len(means) > 1 else nested,
            nested=nested if len(means) > 1 else None,
            counts=(len(values),),
        )


def _difference(
    pair: Contrast, runs: Mapping[str, Sequence[Run]], resampled: Mapping[str, FloatArray]
) -> Contrast:
    """Compare two conditions.

    The difference is that of means over replicates. `interval` is over all rollouts, as if these policies
    were all there is, each rollout counting alike; `nested` over dataset draw,
    training seed and evaluation seed, the wider of the nested bootstrap's and Welch's t interval over
    replicates. p is the largest of the exact test's, the nested bootstrap's, and Welch's: resampling a
    handful of training seeds alone would see too much. Where a condition has one replicate there is neither.
    """
    both = runs[pair.label], runs[pair.baseline]
    estimate = float(replicates(both[0]).mean() - replicates(both[1]).mean())
    found = replace(pair, **vars(compare_rollouts(*both)) | {"estimate": estimate})
    if min(len(replicates(each)) for each in both) < 2:
        return replace(found, p=None, errors=(), reason=_ALONE)
    nested = resampled[pair.label] - resampled[pair.baseline]
    tail = (1 + min(np.count_nonzero(nested <= 0), np.count_nonzero(nested >= 0))) / (len(nested) + 1)
    error, freedom = standard_error(both)
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

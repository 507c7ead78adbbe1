"""How policies trained on the datasets fared, and how sure that is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from handrail.controllers.arrays import FloatArray
from handrail.datasets.comparison.evaluations import SUCCESS, Arm
from handrail.datasets.comparison.proportions import (
    ShareDifference,
    holm,
    paired_difference,
    unpaired_difference,
)
from handrail.datasets.comparison.resampling import Interval, Run, percentiles, resample_runs
from handrail.datasets.paired import wilson

_REACH = 2.8  # standard errors: 5 % two-sided, 80 % power


@dataclass(frozen=True)
class ArmOutcome:
    """One arm.

    Attributes:
        label: Its name.
        successes: Of all rollouts.
        rollouts: Their number.
        wilson: 95 % interval of the success of these very policies.
        nested: 95 % interval over dataset draw, training seed and evaluation seed; None for one run.
        seeds: Success of each trained policy, one after the other.
        draws: Number of draws of the dataset.
        means: Mean of every other outcome a rollout, by name, and its nested 95 % interval.
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
class OutcomeDifference:
    """Success of an arm minus that of the baseline.

    Attributes:
        label: The arm.
        baseline: The other one.
        rollouts: Over all rollouts, as if these policies were all there is.
        nested: 95 % interval over dataset draw, training seed and evaluation seed; None where an arm has
            only one run, since then nothing is known of how much the training seed matters.
        p: Two-sided, the largest of the exact test's, the nested bootstrap's, and Welch's t test of the
            trained policies' success; resampling a handful of training seeds alone would see too much.
        p_adjusted: By Holm, over all differences.
        detectable: The difference that would be seen as one in 80 % of such experiments.
    """

    label: str
    baseline: str
    rollouts: ShareDifference
    nested: Interval | None
    p: float
    p_adjusted: float
    detectable: float

    @property
    def detected(self) -> bool:
        """Whether all intervals leave zero out and the adjusted p is below 0.05."""
        intervals = [self.rollouts.interval, *([self.nested] if self.nested else [])]
        return self.p_adjusted < 0.05 and all(low > 0 or high < 0 for low, high in intervals)


@dataclass(frozen=True)
class Outcomes:
    """All arms, and each against the baseline."""

    arms: tuple[ArmOutcome, ...]
    differences: tuple[OutcomeDifference, ...]


def judge(arms: Mapping[str, Arm], baseline: str, rng: np.random.Generator) -> Outcomes:
    """Compare the success of all arms with the baseline's.

    Args:
        arms: By label.
        baseline: The label that the others are compared with.
        rng: Of the resampling.
    """
    runs = {label: arm.runs() for label, arm in arms.items()}
    resampled = dict(zip(runs, resample_runs(list(runs.values()), rng), strict=True))
    found = tuple(_arm(arm, resampled[label], rng) for label, arm in arms.items())
    others = [label for label in arms if label != baseline]
    raw = [_difference(label, baseline, runs, resampled) for label in others]
    adjusted = holm([difference.p for difference in raw])
    both = zip(raw, adjusted, strict=True)
    return Outcomes(found, tuple(replace(difference, p_adjusted=p) for difference, p in both))


def _arm(arm: Arm, resampled: FloatArray, rng: np.random.Generator) -> ArmOutcome:
    runs = arm.runs()
    values = np.concatenate([run.values for run in runs])
    names = [name for name in arm.outcomes if name != SUCCESS]
    return ArmOutcome(
        label=arm.label,
        successes=int(values.sum()),
        rollouts=len(values),
        wilson=wilson(int(values.sum()), len(values)),
        nested=percentiles(resampled) if len(runs) > 1 else None,
        seeds=tuple(float(run.values.mean()) for run in runs),
        draws=len({run.draw for run in runs}),
        means={name: _mean(arm.runs(name), rng) for name in names},
        trained_on=arm.policies[0].trained_on,
    )


def _mean(runs: Sequence[Run], rng: np.random.Generator) -> tuple[float, Interval]:
    (resampled,) = resample_runs([runs], rng)
    return float(np.mean(np.concatenate([run.values for run in runs]))), percentiles(resampled)


def _difference(
    label: str, baseline: str, runs: Mapping[str, Sequence[Run]], resampled: Mapping[str, FloatArray]
) -> OutcomeDifference:
    shares = compare_rollouts(runs[label], runs[baseline])
    if min(len(runs[label]), len(runs[baseline])) < 2:
        return OutcomeDifference(label, baseline, shares, None, shares.p, shares.p, shares.detectable)
    nested = resampled[label] - resampled[baseline]
    tail = (1 + min(np.count_nonzero(nested <= 0), np.count_nonzero(nested >= 0))) / (len(nested) + 1)
    p = max(shares.p, min(1.0, 2.0 * float(tail)), welch_p(runs[label], runs[baseline]))
    detectable = max(shares.detectable, min(1.0, _REACH * float(nested.std())))
    return OutcomeDifference(label, baseline, shares, percentiles(nested), p, p, detectable)


def welch_p(first: Sequence[Run], second: Sequence[Run]) -> float:
    """Return the p of Welch's t test of the success of trained policies, one number a training seed."""
    one, other = (np.array([run.values.mean() for run in runs]) for runs in (first, second))
    if not one.std() and not other.std():
        return 1.0 if one[0] == other[0] else 0.0
    return float(np.asarray(stats.ttest_ind(one, other, equal_var=False))[1])


def compare_rollouts(first: Sequence[Run], second: Sequence[Run]) -> ShareDifference:
    """Compare all rollouts of two arms, as pairs where training and evaluation seeds are the same."""
    one, other = _rollouts(first), _rollouts(second)
    if one.keys() == other.keys():
        return paired_difference([one[key] for key in one], [other[key] for key in one])
    return unpaired_difference(list(one.values()), list(other.values()))


def _rollouts(runs: Sequence[Run]) -> dict[tuple[int, int, int], bool]:
    return {
        (run.draw, run.training_seed, seed): bool(value)
        for run in runs
        for seed, value in zip(run.seeds, run.values, strict=True)
    }

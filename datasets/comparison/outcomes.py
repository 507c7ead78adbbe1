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
    independent_trials,
    paired_shares,
    reach,
    unpaired_shares,
)
from handrail.datasets.comparison.resampling import Interval, Run, percentiles, resample_runs
from handrail.datasets.paired import wilson

_SAME = 1e-12  # shares that differ by less are the same


@dataclass(frozen=True)
class ArmOutcome:
    """One arm.

    Attributes:
        label: Its name.
        successes: Of all rollouts.
        rollouts: Their number.
        wilson: 95 % interval of the success of these very policies: Wilson's, of as many rollouts as those of
            several policies in the same scenes are worth.
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
        p_adjusted: By Holm, over all differences of the family.
        tests: Number of differences in the family.
        training_error: Standard error over the trained policies, and its degrees of freedom, as Welch has
            them; None where an arm has only one run.
        detectable: The difference that would be seen as one in 80 % of such experiments.
    """

    label: str
    baseline: str
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
    return judge_pairs(arms, [(label, baseline) for label in arms if label != baseline], rng)


def judge_pairs(
    arms: Mapping[str, Arm], pairs: Sequence[tuple[str, str]], rng: np.random.Generator
) -> Outcomes:
    """Compare the success of arms, each with a baseline of its own; all pairs are one family.

    Args:
        arms: By label.
        pairs: Labels of an arm and of what it is compared with.
        rng: Of the resampling.
    """
    runs = {label: arm.runs() for label, arm in arms.items()}
    resampled = dict(zip(runs, resample_runs(list(runs.values()), rng), strict=True))
    found = tuple(_arm(arm, resampled[label], rng) for label, arm in arms.items())
    differences = [_difference(label, baseline, runs, resampled) for label, baseline in pairs]
    return Outcomes(found, one_family(differences))


def one_family(differences: Sequence[OutcomeDifference]) -> tuple[OutcomeDifference, ...]:
    """Return differences with p adjusted by Holm for all of them, and what is detectable then."""
    adjusted, tests = holm([difference.p for difference in differences]), len(differences)
    return tuple(
        replace(difference, p_adjusted=p, tests=tests, detectable=_detectable(difference, tests))
        for difference, p in zip(differences, adjusted, strict=True)
    )


def _detectable(difference: OutcomeDifference, tests: int) -> float:
    """Return what both the test of the rollouts and that of the trained policies would see."""
    found = difference.rollouts.detectable(tests)
    if difference.training_error:
        error, freedom = difference.training_error
        found = max(found, reach(tests, freedom) * error)
    return min(1.0, found)


def _arm(arm: Arm, resampled: FloatArray, rng: np.random.Generator) -> ArmOutcome:
    runs = arm.runs()
    values = np.concatenate([run.values for run in runs])
    worth = independent_trials(values, [seed for run in runs for seed in run.seeds])
    names = [name for name in arm.outcomes if name != SUCCESS]
    return ArmOutcome(
        label=arm.label,
        successes=int(values.sum()),
        rollouts=len(values),
        wilson=wilson(float(values.mean()) * worth, worth),
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
        return OutcomeDifference(label, baseline, shares, None, shares.p, shares.p, 1, None, 1.0)
    nested = resampled[label] - resampled[baseline]
    tail = (1 + min(np.count_nonzero(nested <= 0), np.count_nonzero(nested >= 0))) / (len(nested) + 1)
    p = max(shares.p, min(1.0, 2.0 * float(tail)), welch_p(runs[label], runs[baseline]))
    error = welch_error(runs[label], runs[baseline])
    return OutcomeDifference(label, baseline, shares, percentiles(nested), p, p, 1, error, 1.0)


def welch_p(first: Sequence[Run], second: Sequence[Run]) -> float:
    """Return the p of Welch's t test of the success of trained policies, one number a training seed."""
    difference = float(np.mean(_shares(first)) - np.mean(_shares(second)))
    error, freedom = welch_error(first, second)
    if not error:
        return 1.0 if abs(difference) < _SAME else 0.0
    return 2.0 * float(stats.t.sf(abs(difference) / error, freedom))


def welch_error(first: Sequence[Run], second: Sequence[Run]) -> tuple[float, float]:
    """Return the standard error of the difference of two means over trained policies, as Welch has it.

    √(v₁ + v₂) with v = s² / n, and (v₁ + v₂)² / (v₁² / (n₁ − 1) + v₂² / (n₂ − 1)) degrees of freedom; 0 and ∞
    where the policies of each arm succeed equally often.
    """
    shares = [_shares(runs) for runs in (first, second)]
    parts = [each.var(ddof=1) / len(each) if np.ptp(each) > _SAME else 0.0 for each in shares]
    if not any(parts):
        return 0.0, float("inf")
    below = sum(part**2 / (len(each) - 1) for part, each in zip(parts, shares, strict=True))
    return float(np.sqrt(sum(parts))), float(sum(parts) ** 2 / below)


def _shares(runs: Sequence[Run]) -> FloatArray:
    """Return the success of each trained policy."""
    return np.array([run.values.mean() for run in runs])


def compare_rollouts(first: Sequence[Run], second: Sequence[Run]) -> ShareDifference:
    """Compare all rollouts of two arms, as pairs where training and evaluation seeds are the same."""
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

"""Means over participants, and how conditions differ within them: participants are what is resampled."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.comparison.people.measures import known
from handrail.datasets.comparison.people.trials import Trial
from handrail.datasets.quality.metric import Metric
from handrail.datasets.statistics.proportions import LEVEL, holm
from handrail.datasets.statistics.resampling import (
    FEWEST,
    Interval,
    bootstrap_mean,
    difference_of_means,
    permutation_p,
)

Scenes = Mapping[int | None, Sequence[float]]  # values by scene
OfPeople = Mapping[str, Scenes]  # by participant


@dataclass(frozen=True)
class Mean:
    """A measure under one condition.

    Attributes:
        label: the condition.
        scripted: whether scripted operators steered; then an episode counts as a participant does.
        count: participants (or scripted episodes) with a value.
        total: participants (or scripted episodes) there are.
        mean: of their means; None without any.
        interval: 95 %, bootstrap over them; None for fewer than five.
    """

    label: str
    scripted: bool
    count: int
    total: int
    mean: float | None = None
    interval: Interval | None = None


@dataclass(frozen=True)
class Contrast:
    """A measure under a condition minus the same under the baseline, within participants.

    Attributes:
        measure: which.
        label: the condition.
        baseline: the other.
        count: participants with a value under both.
        estimate: mean over them; None without any.
        interval: 95 %, bootstrap over participants; None for fewer than five.
        p: permutation test, the signs of participants' differences swapped; None for fewer than five, and
            where nobody differs.
        p_adjusted: by Holm, over all that is tested in the same table of differences.
    """

    measure: Metric
    label: str
    baseline: str
    count: int
    estimate: float | None = None
    interval: Interval | None = None
    p: float | None = None
    p_adjusted: float | None = None

    @property
    def detected(self) -> bool:
        """Whether the interval leaves zero out and the adjusted p is below 0.05."""
        if self.interval is None or self.p_adjusted is None:
            return False
        return self.p_adjusted < LEVEL and not self.interval[0] <= 0.0 <= self.interval[1]


def of_people(trials: Sequence[Trial], measure: str) -> dict[str, dict[int | None, list[float]]]:
    """Return a measure's values by participant and scene; who has none is there, with none."""
    found: dict[str, dict[int | None, list[float]]] = {}
    for trial in trials:
        if trial.participant:
            scenes = found.setdefault(trial.participant, {})
            if known(trial.values[measure]):
                scenes.setdefault(trial.scene, []).append(trial.values[measure])
    return found


def mean_of_people(label: str, values: OfPeople, total: int, rng: np.random.Generator) -> Mean:
    """Return the mean over participants of each one's mean.

    Args:
        label: of the condition.
        values: of its participants.
        total: participants there are.
        rng: of the resampling.
    """
    means = np.array([_mean(scenes) for scenes in values.values() if scenes])
    return _summed(Mean(label, False, len(means), total), means, rng)


def mean_of_scripts(label: str, values: Sequence[float], rng: np.random.Generator) -> Mean:
    """Return the mean over episodes of scripted operators; what is not known is left out."""
    numbers = np.array([value for value in values if known(value)])
    return _summed(Mean(label, True, len(numbers), len(values)), numbers, rng)


def contrast(
    measure: Metric, label: str, baseline: str, one: OfPeople, other: OfPeople, rng: np.random.Generator
) -> Contrast:
    """Return how a condition differs from the baseline, paired by participant, and by scene where possible.

    d_p = mean over the scenes that participant p met under both; where they met none twice, the difference of
    their means. The estimate is the mean of d_p.

    Args:
        measure: which.
        label: the condition.
        baseline: the other.
        one: values under the condition.
        other: values under the baseline.
        rng: of resampling and permutation.
    """
    both = [name for name in one if one[name] and other.get(name)]
    differences = np.array([_difference(one[name], other[name]) for name in both])
    found = Contrast(measure, label, baseline, len(both))
    if not both:
        return found
    found = replace(found, estimate=float(differences.mean()))
    if len(both) < FEWEST:
        return found
    found = replace(found, interval=bootstrap_mean(differences, rng))
    if not differences.any():
        return found
    p = permutation_p((differences, np.zeros_like(differences)), difference_of_means, True, rng)
    return replace(found, p=p)


def within_reach(contrasts: Sequence[Contrast]) -> bool:
    """Return whether any difference could be detected: if all participants differ alike, p is 2¹⁻ⁿ."""
    tested = [each for each in contrasts if each.p is not None]
    return any(len(tested) * 2.0 ** (1 - each.count) < LEVEL for each in tested)


def adjusted(contrasts: Sequence[Contrast]) -> list[Contrast]:
    """Return contrasts with their p after Holm."""
    after = iter(holm([each.p for each in contrasts if each.p is not None]))
    return [each if each.p is None else replace(each, p_adjusted=next(after)) for each in contrasts]


def _summed(found: Mean, values: FloatArray, rng: np.random.Generator) -> Mean:
    if not len(values):
        return found
    interval = bootstrap_mean(values, rng) if len(values) >= FEWEST else None
    return replace(found, mean=float(values.mean()), interval=interval)


def _mean(scenes: Scenes) -> float:
    return float(np.mean([value for values in scenes.values() for value in values]))


def _difference(one: Scenes, other: Scenes) -> float:
    shared = [scene for scene in one if scene is not None and scene in other]
    if not shared:
        return _mean(one) - _mean(other)
    return float(np.mean([np.mean(one[scene]) - np.mean(other[scene]) for scene in shared]))

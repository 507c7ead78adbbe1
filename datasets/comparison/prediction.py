"""Which metric of demonstrations says beforehand how policies will do: over all that were trained.

A cell is a recording and the policies that learnt from it. Ranks are compared within a task, since tasks
differ in metrics and in success alike: between modes, each the mean of its recordings; and between recordings
of one mode, which says whether a metric tells a better recording from a worse one. A mode in two tasks is one
mode, and a draw in all modes one draw, of the same persons: these are exchanged as a whole.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handrail.datasets.learnability.learnability import LEARNABILITY, TITLES, TWO_HEAPS
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.statistics.proportions import LEVEL, holm
from handrail.datasets.statistics.ranks import RankCorrelation, rank_correlation

_GOOD = {metric.name: metric.good for metric in METRICS} | {LEARNABILITY: "higher", TWO_HEAPS: "lower"}
_TITLES = {metric.name: metric.title for metric in METRICS} | TITLES


@dataclass(frozen=True)
class PolicyCell:
    """A recording, and the policies that were trained on it.

    Attributes:
        task: What was done.
        condition: How: the mode, or another name of what was varied.
        draw: Which recording of these.
        success: Share of the rollouts of its policies.
        metrics: Mean of each metric by name; None where it does not apply.
    """

    task: str
    condition: str
    draw: int
    success: float
    metrics: Mapping[str, float | None]


@dataclass(frozen=True)
class MetricPrediction:
    """How the ranks of a metric go with those of success.

    Attributes:
        metric: Its name.
        between: Between conditions of a task, each the mean of its recordings; None where nothing varies.
        within: Between recordings of one condition of a task; None where there is one of each.
        p_between: By Holm, over all metrics.
        p_within: The same.
    """

    metric: str
    between: RankCorrelation | None
    within: RankCorrelation | None
    p_between: float = 1.0
    p_within: float = 1.0

    @property
    def title(self) -> str:
        """What people call it."""
        return _TITLES.get(self.metric, self.metric)

    @property
    def good(self) -> str:
        """Which end was thought to be better: `higher`, `lower` or ""."""
        return _GOOD.get(self.metric, "")

    @property
    def between_detected(self) -> bool:
        """Whether it is there between modes: the interval leaves zero out, the adjusted p is below 0.05."""
        return _detected(self.between, self.p_between)

    @property
    def within_detected(self) -> bool:
        """The same between recordings of one mode."""
        return _detected(self.within, self.p_within)

    @property
    def detected(self) -> bool:
        """Whether either is there."""
        return self.between_detected or self.within_detected


def _detected(found: RankCorrelation | None, p: float) -> bool:
    return found is not None and p < LEVEL and not found.interval[0] <= 0.0 <= found.interval[1]


def predictions(cells: Sequence[PolicyCell], rng: np.random.Generator) -> list[MetricPrediction]:
    """Return how each metric goes with success, the closest first.

    Args:
        cells: Of all tasks; a metric that a cell lacks is judged without it.
        rng: Of the resampling.
    """
    names = list(dict.fromkeys(name for cell in cells for name in cell.metrics))
    found = [MetricPrediction(name, _between(cells, name, rng), _within(cells, name, rng)) for name in names]
    for side, adjusted in (("between", "p_between"), ("within", "p_within")):
        known = [place for place, each in enumerate(found) if getattr(each, side)]
        for place, p in zip(known, holm([getattr(found[place], side).p for place in known]), strict=True):
            found[place] = replace(found[place], **{adjusted: p})
    return sorted(found, key=_order)


def _order(each: MetricPrediction) -> tuple[float, float]:
    between, within = (-abs(part.estimate) if part else 1.0 for part in (each.between, each.within))
    return between, within


def _between(cells: Sequence[PolicyCell], name: str, rng: np.random.Generator) -> RankCorrelation | None:
    members: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for cell in cells:
        value = cell.metrics.get(name)
        if value is not None:
            members.setdefault((cell.task, cell.condition), []).append((value, cell.success))
    if not members:
        return None
    means = np.array([np.mean(each, axis=0) for each in members.values()])
    tasks, conditions = zip(*members, strict=True)
    return rank_correlation(means[:, 0], means[:, 1], tasks, conditions, rng)


def _within(cells: Sequence[PolicyCell], name: str, rng: np.random.Generator) -> RankCorrelation | None:
    values = np.array([np.nan if (v := cell.metrics.get(name)) is None else v for cell in cells], float)
    success = np.array([cell.success for cell in cells])
    strata = [(cell.task, cell.condition) for cell in cells]
    return rank_correlation(values, success, strata, [cell.draw for cell in cells], rng)

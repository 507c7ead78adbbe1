"""One value for every comparison: a measure under one condition against the same under another.

Conditions are datasets, teleop modes, trained policies; the unit of resampling is what was drawn anew: an
episode, a participant, a trained policy, a draw of a study. Each unit has a test of its own; the result is
the same value, corrected for the number of tests in the same way.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.statistics.resampling import FEWEST, Interval, bootstrap_mean

LEVEL = 0.05  # below which a p that is adjusted for their number counts
POWER = 0.8
SHARE, RATIO = "share", "ratio"  # units that are shown as percentage points, and as a factor
_OF_CSV = (
    *("estimate", "interval", "spread", "p", "p_adjusted"),
    *("at_length", "at_length_interval", "follows_length"),
)
_HIDDEN = ("measure", "scope", "label", "values", "incomparable", "largest", "null", "reason")
_NO_SPREAD = 1e-9  # of a value: a standard deviation below is rounding


@dataclass(frozen=True)
class Measure:
    """A quantity that is compared."""

    name: str  # in JSON and CSV
    title: str  # for people
    unit: str = ""  # "" for a pure number
    good: str = ""  # "higher" or "lower" where everything else being equal that is better
    meaning: str = ""  # one sentence

    @property
    def heading(self) -> str:
        """The title with the unit, if there is one."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A number, or a difference, and how sure it is; None for what nothing is known of."""

    estimate: float | None = None
    interval: Interval | None = None  # 95 %
    nested: Interval | None = None  # 95 % with the training of policies drawn anew, too, where that is known
    p: float | None = None  # two-sided, of there being no difference
    counts: tuple[int, ...] = ()  # units of condition and baseline; one number where they are pairs
    errors: tuple[tuple[float, float], ...] = ()  # standard error and degrees of freedom of each test
    paired: bool = False  # whether the same units were measured under both
    largest: float = float("inf")  # difference that there may be

    def detectable(self, tests: int = 1) -> float | None:
        """Return the difference that 80 % of such experiments detect after Holm over so many tests."""
        if not self.errors:
            return None
        return min(self.largest, max(reach(tests, freedom) * error for error, freedom in self.errors))


@dataclass(frozen=True, kw_only=True)
class Value(Estimate):
    """A measure under one condition, over its units: episodes, participants, trained policies, draws."""

    measure: Measure
    label: str  # of the condition
    scope: str = ""  # which episodes, task or tasks
    values: FloatArray = field(default_factory=lambda: np.empty(0), compare=False)
    """Of each unit; NaN where it has none."""
    reason: str = ""  # why there is none, the commonest if several

    @property
    def known(self) -> FloatArray:
        """The values that are there."""
        return self.values[np.isfinite(self.values)]

    @property
    def widest(self) -> Interval | None:
        """The interval that holds for policies trained anew, too, if it is known."""
        return self.nested or self.interval

    @property
    def named(self) -> dict[str, Any]:
        """Its names, for JSON and CSV."""
        names = {"view": self.scope, "metric": self.measure.name, "unit": self.measure.unit}
        return names | {"group": self.label}

    @property
    def content(self) -> dict[str, Any]:
        """The entry in the JSON of every report."""
        numbers = (each.name for each in fields(self) if each.name not in _HIDDEN)
        reason = {"does_not_apply": self.reason}
        return self.named | reason | {name: getattr(self, name) for name in numbers}


@dataclass(frozen=True, kw_only=True)
class Contrast(Value):
    """A measure under a condition minus the same under the baseline.

    Of a metric whose unit is the dataset there is an estimate alone: the values of its episodes share
    neighbours, and resampling would take them for independent.
    """

    baseline: str = ""
    family: str = ""  # of tests that p is adjusted for, declared before anything is known of the results
    p_adjusted: float | None = None  # by Holm over the family; None where nothing is tested
    tests: int = 1  # in the family
    null: float = 0.0  # no difference: 1 for a ratio
    sides: tuple[float, float] | None = None  # means of what is added and taken off, of several conditions
    incomparable: str = ""  # why the units of both are not known to be the same, where both have values
    spread: float | None = None  # standard deviation within groups, pooled
    at_length: float | None = None  # estimate without the linear dependence on length, within groups
    at_length_interval: Interval | None = None  # 95 %, bootstrap
    follows_length: float | None = None  # Spearman's ρ with episode length within groups

    @property
    def detected(self) -> bool:
        """Whether every interval is on the same side of no difference and the adjusted p is below 0.05."""
        if self.p_adjusted is None or self.interval is None:
            return False
        (low, high), (lowest, highest) = self.interval, self.nested or self.interval
        return self.p_adjusted < LEVEL and (min(low, lowest) > self.null or max(high, highest) < self.null)

    @property
    def at_equal_length(self) -> bool:
        """Whether what was detected, in its direction, is also there at equal length."""
        low, high = self.at_length_interval or (0.0, 0.0)
        return self.detected and (low > 0.0 if (self.estimate or 0.0) > 0.0 else high < 0.0)

    @property
    def seen(self) -> float | None:
        """The difference that such an experiment detects in 80 % of all cases, for so many tests."""
        return self.detectable(self.tests)

    @property
    def effect(self) -> tuple[float, ...]:
        """Estimate and interval in standard deviations; infinite for a difference where nothing varies."""
        values = (self.estimate or 0.0, *(self.interval or (0, 0)))
        return tuple(_in_spreads(each, self.spread or 0.0) for each in values)

    @property
    def row(self) -> dict[str, Any]:
        """The row in the CSV of every report: the names and the numbers, an interval in two columns."""
        found = self.named | {"baseline": self.baseline, "does_not_apply": self.reason}
        for name in _OF_CSV:
            value = getattr(self, name)
            if name.endswith("interval"):
                found[f"{name}_low"], found[f"{name}_high"] = value or (None, None)
            else:
                found[name] = value
        return found

    @property
    def content(self) -> dict[str, Any]:
        """The entry in the JSON of every report."""
        return super().content | {"detected": self.detected, "detectable": self.seen}


def mean_value(
    measure: Measure, label: str, values: FloatArray, rng: np.random.Generator | None, **more: Any
) -> Value:
    """Return the mean of a measure over the units that have a value, NaN where one has none.

    Its interval is there for five or more, and if there is an `rng` to resample them.
    """
    known = values[np.isfinite(values)]
    return Value(
        measure=measure,
        label=label,
        values=values,
        estimate=float(known.mean()) if len(known) else None,
        interval=bootstrap_mean(known, rng) if rng and len(known) >= FEWEST else None,
        counts=(len(known),),
        **more,
    )


def contrast(one: Value, other: Value, found: Estimate, **more: Any) -> Contrast:
    """Return how a measure differs between two conditions, by what was found of that."""
    names = {"measure": one.measure, "label": one.label, "baseline": other.label, "scope": one.scope}
    return Contrast(**names | vars(found) | more)


def _in_spreads(value: float, spread: float) -> float:
    if spread > _NO_SPREAD * abs(value):
        return value / spread
    return float(np.copysign(np.inf, value)) if value else 0.0


def adjusted[C: Contrast](contrasts: Iterable[C]) -> list[C]:
    """Return contrasts with p adjusted by Holm over those of their family that are tested."""
    found, members = list(contrasts), dict[str, list[int]]()
    for place, each in enumerate(found):
        if each.p is not None:
            members.setdefault(each.family, []).append(place)
    for places in members.values():
        after = holm([p for place in places if (p := found[place].p) is not None])
        for place, p in zip(places, after, strict=True):
            found[place] = replace(found[place], p_adjusted=p, tests=len(places))
    return found


def holm(p: Sequence[float]) -> list[float]:
    """Return p-values adjusted for there being several (Holm 1979): p'_(i) = max_{j ≤ i} (m − j + 1) p_(j).

    Args:
        p: `(m,)`.

    Returns:
        In the same order, at most 1.
    """
    order = np.argsort(p)
    steps = np.arange(len(p), 0, -1) * np.asarray(p, float)[order]
    found = np.empty(len(p))
    found[order] = np.minimum(1.0, np.maximum.accumulate(steps))
    return found.tolist()


def reach(tests: int = 1, freedom: float = np.inf) -> float:
    """Return how many standard errors a difference has to have, to be detected in 80 % of experiments.

    t_{1 − α/2m} + t_{0.8}, of the t distribution; m tests, of which Holm gives the smallest p the level α/m.

    Args:
        tests: m.
        freedom: Degrees of freedom with which the standard error is known; ∞ is the normal distribution.
    """
    from scipy import stats  # a recording must start at once

    return float(stats.t.ppf(1.0 - 0.5 * LEVEL / max(1, tests), freedom) + stats.t.ppf(POWER, freedom))

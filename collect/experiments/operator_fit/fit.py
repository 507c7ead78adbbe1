"""Fits the scripted operator to recorded people: approximate Bayesian computation with regression.

```
recorded episodes ─ what was seen ─▶ scripted operators, their numbers drawn ─ statistics ─┐
        └─ what was done ─ statistics ──────────▶ regression of the numbers on statistics ◀┘
```
In each round the numbers are drawn from a narrower box about the last estimate. Beaumont, Zhang & Balding
2002, "Approximate Bayesian computation in population genetics"; Fearnhead & Prangle 2012 for the regression.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from handrail.collect.experiments.operator_fit.episodes import Steered
from handrail.collect.experiments.operator_fit.parameters import PARAMETERS, Parameter, untold
from handrail.collect.experiments.operator_fit.regression import Regression
from handrail.collect.experiments.operator_fit.shadow import Shadow
from handrail.collect.experiments.operator_fit.statistics import NAMES, resampled, statistics
from handrail.collect.operators.human.human import HumanSettings
from handrail.controllers.arrays import FloatArray
from handrail.datasets.statistics.resampling import FEWEST, RESAMPLES, Interval, percentiles

ROUNDS = 4
_NARROW = 2.5  # half a box, in standard deviations of the last estimate
_VAGUE = 0.45  # standard deviation of the logarithm from which on a number is not told
_CHECKS = 24  # operators with the fitted numbers, and with the defaults, that are compared with the person
TRIED_BESIDE = 2 * _CHECKS
_WORST = 3
UNLIKE = 5.0  # standard deviations from which on no scripted operator steers like the person


@dataclass(frozen=True)
class Estimate:
    """What was found of one number.

    Attributes:
        name: of the number.
        unit: of it.
        default: the scripted operator's.
        value: fitted; None where the episodes do not tell it.
        interval: 95 %, episodes resampled, what the regression misses added; None for few episodes.
        reason: why there is no value; "" where there is one.
    """

    name: str
    unit: str
    default: float
    value: float | None = None
    interval: Interval | None = None
    reason: str = ""

    @property
    def differs(self) -> bool:
        """Whether the default lies outside the interval."""
        return bool(self.interval) and not self.interval[0] <= self.default <= self.interval[1]


@dataclass(frozen=True)
class Likeness:
    """How far a person's statistics are from a scripted operator's, in standard deviations of the latter's.

    Attributes:
        fitted: root mean square over the statistics, of the fitted operator.
        default: the same of the default one.
        worst: the statistics in which the fitted one is least like the person.
    """

    fitted: float
    default: float
    worst: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Fit:
    """What was found.

    Attributes:
        episodes: how many were used.
        seconds: of steering [s].
        device: what was held; "" for a script.
        keys: whether it had on/off keys.
        gain: of the device's operator, before briskness [1/s].
        estimates: of every number.
        human: the defaults, with the fitted numbers.
        likeness: how alike person and model are.
    """

    episodes: int
    seconds: float
    device: str
    keys: bool
    gain: float
    estimates: tuple[Estimate, ...]
    human: HumanSettings
    likeness: Likeness


def fit_operator(
    episodes: Sequence[Steered], draws: int, rng: np.random.Generator, tell: Callable[[], None] = lambda: None
) -> Fit:
    """Return the scripted operator whose input is most like what was recorded.

    Args:
        episodes: of one person, or of several; one or more, of one device (`check_alike`).
        draws: scripted operators that are tried in each of `ROUNDS` rounds.
        rng: of everything that is drawn.
        tell: is called after each scripted operator.
    """
    reasons = untold(episodes)
    fitted = [each for each in PARAMETERS if each.name not in reasons]
    shadows = [Shadow(each) for each in episodes]
    recorded = np.array([each.recorded() for each in shadows])
    trials = _Trials(shadows, fitted, rng, tell)
    regression = _narrowed(trials, statistics(recorded), draws)
    estimates = _estimates(regression, fitted, recorded, rng)
    likeness = _likeness(trials, _with(estimates), statistics(recorded))
    estimates = believed([*estimates, *_others(reasons)], likeness)
    return Fit(
        episodes=len(episodes),
        seconds=sum(len(each.inputs) / each.fps for each in episodes),
        device=episodes[0].device,
        keys=episodes[0].keys,
        gain=episodes[0].gains.gain,
        estimates=estimates,
        human=_with(estimates),
        likeness=likeness,
    )


def _with(estimates: Sequence[Estimate]) -> HumanSettings:
    """Return the default settings with what was fitted."""
    return replace(HumanSettings(), **{each.name: each.value for each in estimates if each.value is not None})


def _others(reasons: Mapping[str, str]) -> list[Estimate]:
    """Return what the episodes cannot tell, whatever its value."""
    return [Estimate(name, "", getattr(HumanSettings(), name), reason=why) for name, why in reasons.items()]


def believed(estimates: Sequence[Estimate], likeness: Likeness) -> tuple[Estimate, ...]:
    """Return the estimates, without their values where no scripted operator steers like the person.

    That is where the fitted one is far from the person, and no nearer than the default one.
    """
    if likeness.fitted < max(UNLIKE, likeness.default):
        return tuple(estimates)
    reason = "no scripted operator steers like this input, so a number would mean nothing"
    return tuple(
        each if each.value is None else replace(each, value=None, interval=None, reason=reason)
        for each in estimates
    )


class _Trials:
    """Scripted operators that are tried on the same episodes.

    Args:
        shadows: of the episodes.
        fitted: what is drawn.
        rng: draws.
        tell: is called after each.
    """

    def __init__(
        self,
        shadows: Sequence[Shadow],
        fitted: Sequence[Parameter],
        rng: np.random.Generator,
        tell: Callable[[], None],
    ) -> None:
        self._shadows, self._fitted, self._rng, self._tell = shadows, fitted, rng, tell
        self.low = np.log([each.low for each in fitted])
        self.high = np.log([each.high for each in fitted])

    def draw(self, low: FloatArray, high: FloatArray, count: int) -> FloatArray:
        """Return logarithms of the numbers, spread evenly over a box, (count, p)."""
        return low + (high - low) * qmc.LatinHypercube(len(low), rng=self._rng).random(count)

    def run(self, logs: FloatArray) -> FloatArray:
        """Return the statistics of operators with these numbers, (N, s)."""
        names = [each.name for each in self._fitted]
        return np.array(
            [
                self.statistics(replace(HumanSettings(), **dict(zip(names, row, strict=True))))
                for row in np.exp(logs)
            ]
        )

    def statistics(self, human: HumanSettings) -> FloatArray:
        """Return the statistics of one operator, (s,)."""
        found = statistics(np.array([each.simulated(human, self._rng) for each in self._shadows]))
        self._tell()
        return found


def _narrowed(trials: _Trials, wanted: FloatArray, draws: int) -> Regression:
    """Return the regression of the last round, about where the statistics wanted come from."""
    low, high = trials.low, trials.high
    logs, found = np.empty((0, len(low))), np.empty((0, len(wanted)))
    for last in (*[False] * (ROUNDS - 1), True):
        more = trials.draw(low, high, draws)
        logs, found = np.vstack([logs, more]), np.vstack([found, trials.run(more)])
        inside = np.all((logs >= low) & (logs <= high), axis=1)
        regression = Regression.of(found[inside], logs[inside])
        if not last:
            half = _NARROW * regression.residuals.std(axis=0)
            centre = np.clip(regression.predict(wanted), low + 0.5 * half, high - 0.5 * half)
            low, high = np.maximum(low, centre - half), np.minimum(high, centre + half)
    return regression


def _estimates(
    regression: Regression, fitted: Sequence[Parameter], recorded: FloatArray, rng: np.random.Generator
) -> list[Estimate]:
    values = regression.predict(statistics(recorded))
    again = regression.predict(resampled(recorded, RESAMPLES, rng))
    missed = regression.residuals[rng.integers(len(regression.residuals), size=RESAMPLES)]
    spread = again + missed
    found = []
    for place, each in enumerate(fitted):
        default = getattr(HumanSettings(), each.name)
        low, high = np.exp(percentiles(spread[:, place])).tolist()
        blank = Estimate(each.name, each.unit, default)
        if float(spread[:, place].std()) > _VAGUE:
            reason = f"the episodes do not tell it: anything from {low:.2g} to {high:.2g} is as likely"
            found.append(replace(blank, reason=reason))
            continue
        interval = (low, high) if len(recorded) >= FEWEST else None
        found.append(replace(blank, value=float(np.exp(values[place])), interval=interval))
    return found


def _likeness(trials: _Trials, human: HumanSettings, recorded: FloatArray) -> Likeness:
    away, usual = (_away(trials, each, recorded) for each in (human, HumanSettings()))
    worst = np.argsort(-np.abs(away))[:_WORST]
    return Likeness(
        fitted=float(np.sqrt(np.mean(away**2))),
        default=float(np.sqrt(np.mean(usual**2))),
        worst=tuple((NAMES[place], float(away[place])) for place in worst),
    )


def _away(trials: _Trials, human: HumanSettings, recorded: FloatArray) -> FloatArray:
    """Return how far recorded statistics are from those of an operator, in standard deviations, (s,)."""
    found = np.array([trials.statistics(human) for _ in range(_CHECKS)])
    spread = found.std(axis=0, ddof=1)
    return np.where(
        spread > 1e-9, (recorded - found.mean(axis=0)) / np.where(spread > 1e-9, spread, 1.0), 0.0
    )

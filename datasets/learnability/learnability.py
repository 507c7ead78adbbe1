"""How much of the actions a policy could tell from what it sees, and what it may be missing.

R² is of a kernel ridge regression on episodes that it was not fitted to. As a first proxy for what policies
learn it misjudged: data of 0.71 and 0.78 gave policies that reach 76 and 95 %. It is a metric to be tested.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray, IntArray
from handrail.datasets.demonstrations.demonstration import DoesNotApply
from handrail.datasets.demonstrations.episode import Episode
from handrail.datasets.learnability.kernel_ridge import held_out
from handrail.datasets.learnability.parts import ALL, GRIPPER, parts
from handrail.datasets.learnability.policy_rows import PolicyView, recorded_view
from handrail.datasets.learnability.sample import Budget, Sample, take
from handrail.datasets.learnability.two_heaps import NEIGHBOURS, two_heaps
from handrail.datasets.quality.pool import Spread, embed
from handrail.datasets.statistics.resampling import Interval, percentiles

CAVEAT = (
    "R² is not success. As a first proxy it misjudged: policies of data with R² 0.71 and 0.78 reached 76 and"
    " 95 %. Look at it beside what policies did, and rank nothing by it."
)
LEARNABILITY, TWO_HEAPS = "learnability", "two_heaps"
TITLES = {LEARNABILITY: "learnability (R²)", TWO_HEAPS: "two heaps"}
_FOLDS = 5
_RESAMPLES = 1000
_COMPONENTS = 8  # of what is seen, to find like observations
_LANDMARKS = 256
_WEIGHT = 0.5  # of a hidden variable beside all that is seen
_ROUNDING = 1e-6  # of single precision
_LEAST = 1e-9  # of the variance: what is left below it is rounding


@dataclass(frozen=True)
class Score:
    """A number of a sample of episodes.

    Attributes:
        estimate: The number.
        interval: 95 %, over the episodes that were held out; the regressions are not fitted anew.
    """

    estimate: float
    interval: Interval


@dataclass(frozen=True)
class Predictability:
    """How well the actions of one action space can be told.

    Attributes:
        parts: R² by part of the robot, `all` first: 1 all, 0 no better than the mean, less is worse.
        gains: By candidate and part: R² with it minus R² without it.
        phases: R² of all parts within each phase, against the phase's own mean.
        two_heaps: Share of what is left near like observations that lies in two heaps; 0.05 by chance; None
            for 16 episodes or fewer.
    """

    parts: Mapping[str, Score]
    gains: Mapping[str, Mapping[str, Score]]
    phases: Mapping[str, Score]
    two_heaps: Score | None


@dataclass(frozen=True)
class Learnability:
    """Of a group of episodes.

    Attributes:
        episodes: How many were looked at.
        frames: Of these.
        inputs: How many numbers a policy reads.
        shown: Candidates that are among these.
        spaces: By action space.
    """

    episodes: int
    frames: int
    inputs: int
    shown: tuple[str, ...]
    spaces: Mapping[str, Predictability]

    @property
    def usual(self) -> tuple[str, Predictability]:
        """The first action space and what can be told of it."""
        return next(iter(self.spaces.items()))

    @property
    def metrics(self) -> dict[str, float]:
        """A few numbers for the whole group, by name: of the usual action space, all parts."""
        _, usual = self.usual
        found = {LEARNABILITY: usual.parts[ALL].estimate}
        found |= {TWO_HEAPS: usual.two_heaps.estimate} if usual.two_heaps else {}
        gains = {name: by_part[ALL].estimate for name, by_part in usual.gains.items()}
        return found | {f"gain of {name}": gain for name, gain in gains.items()}


def learnability(
    episodes: Sequence[Episode],
    rng: np.random.Generator,
    view: PolicyView = recorded_view,
    budget: Budget | None = None,
) -> Learnability:
    """Return R² = 1 − Σ (y − ŷ)² / Σ (y − ȳ)² of the actions, held out by episodes.

    Each entry of the action is divided by its standard deviation; entries that never change are left out.

    Args:
        episodes: Of one group.
        rng: Of the choice of episodes, folds, and the intervals: the same seed gives the same numbers.
        view: What a policy reads and writes.
        budget: How many episodes and frames at most.

    Raises:
        DoesNotApply: There are too few episodes, or nothing in them that a policy could learn.
    """
    sample = take(episodes, view, budget or Budget(), rng)
    fold = (rng.permutation(sample.episodes) % _FOLDS)[sample.owner]
    landmarks = rng.permutation(len(sample.seen))[: min(_LANDMARKS, len(sample.seen) // 4)]
    draws = rng.multinomial(sample.episodes, np.full(sample.episodes, 1.0 / sample.episodes), _RESAMPLES)
    return _Judge(sample, fold, landmarks, draws.T).learnability()


@dataclass(frozen=True)
class _Judge:
    """What all regressions of a sample share.

    Attributes:
        sample: The frames.
        fold: Of each frame, `(N,)`.
        landmarks: Of the regressions.
        draws: How often each episode is in each resample, `(E, B)`.
    """

    sample: Sample
    fold: IntArray
    landmarks: IntArray
    draws: IntArray

    def learnability(self) -> Learnability:
        """Fit all action spaces at once, without and with each hidden variable, and judge each."""
        sample, seen = self.sample, _standardised(self.sample.seen)
        wanted = {space: _standardised(actions.values) for space, actions in sample.actions.items()}
        left = self._left(seen, wanted)
        others = {name: self._left(inputs, wanted) for name, inputs in self._changed(seen)}
        spaces = {}
        for space, actions in sample.actions.items():
            moving = _changes(actions.values)
            groups = parts([name for name, moves in zip(actions.names, moving, strict=True) if moves])
            spaces[space] = Predictability(
                parts={
                    part: self._explained(left[space][:, of], wanted[space][:, of])
                    for part, of in groups.items()
                },
                gains={
                    name: {
                        part: self._gain(name, left[space][:, of], other[space][:, of], wanted[space][:, of])
                        for part, of in groups.items()
                    }
                    for name, other in others.items()
                },
                phases=dict(self._phases(left[space], wanted[space])),
                two_heaps=self._heaps(seen, left[space], groups),
            )
        return Learnability(sample.episodes, len(seen), seen.shape[1], tuple(sample.shown), spaces)

    def _changed(self, seen: FloatArray) -> Iterator[tuple[str, FloatArray]]:
        """Yield inputs with each candidate that is hidden, and without each that is seen."""
        sample = self.sample
        for name, values in sample.hidden.items():
            if name in sample.shown:
                yield name, _standardised(np.delete(sample.seen, sample.shown[name], axis=1))
            elif _changes(values).any():
                yield name, _beside(seen, _standardised(values))

    def _left(self, inputs: FloatArray, wanted: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return what a regression leaves of the actions, by action space."""
        values = np.hstack(list(wanted.values()))
        left = values - held_out(inputs, values, self.fold, self.landmarks)
        ends = np.cumsum([each.shape[1] for each in wanted.values()])
        return dict(zip(wanted, np.hsplit(left, ends[:-1]), strict=True))

    def _gain(self, name: str, left: FloatArray, other: FloatArray, wanted: FloatArray) -> Score:
        sign = -1.0 if name in self.sample.shown else 1.0
        return self._ratio(sign * (left**2 - other**2).sum(axis=1), (wanted**2).sum(axis=1))

    def _explained(self, left: FloatArray, wanted: FloatArray, rows: BoolArray | None = None) -> Score:
        total = (wanted**2).sum(axis=1)
        return self._ratio(total - (left**2).sum(axis=1), total, rows)

    def _phases(self, left: FloatArray, wanted: FloatArray) -> Iterator[tuple[str, Score]]:
        for phase in dict.fromkeys(self.sample.phase.tolist()):
            rows = self.sample.phase == phase
            away = wanted[rows] - wanted[rows].mean(axis=0)
            if (away**2).sum() > _LEAST * rows.sum():
                yield phase, self._explained(left[rows], away, rows)

    def _heaps(self, seen: FloatArray, left: FloatArray, groups: Mapping[str, list[int]]) -> Score | None:
        """Judge motion only: a gripper's command has two values anyway."""
        if self.sample.episodes <= NEIGHBOURS:
            return None
        switches = groups.get(GRIPPER, [])
        motion = [place for place in groups[ALL] if place not in switches] or groups[ALL]
        spread = Spread()
        spread.add(seen)
        near, heaped = two_heaps(embed(spread, _COMPONENTS)(seen), left[:, motion], self.sample.owner)
        if near.sum() <= _LEAST * len(near):
            return Score(0.0, (0.0, 0.0))
        return self._ratio(heaped, near)

    def _ratio(self, top: FloatArray, bottom: FloatArray, rows: BoolArray | None = None) -> Score:
        """Return Σ top / Σ bottom of some frames, episodes resampled."""
        owner = self.sample.owner if rows is None else self.sample.owner[rows]
        sums = [np.bincount(owner, each, self.sample.episodes) for each in (top, bottom)]
        above, below = (each @ self.draws for each in sums)
        known = below > 0.0
        return Score(float(sums[0].sum() / sums[1].sum()), percentiles(above[known] / below[known]))


def _beside(seen: FloatArray, hidden: FloatArray) -> FloatArray:
    """Return what is seen and a hidden variable, whose variance counts a quarter of all that is seen."""
    weight = _WEIGHT * np.sqrt(seen.shape[1] / hidden.shape[1])
    return np.hstack([seen, weight * hidden])


def _changes(rows: FloatArray) -> BoolArray:
    """Return which columns are more than rounding, `(d,)`."""
    return rows.std(axis=0) > _ROUNDING * np.maximum(1.0, np.abs(rows.mean(axis=0)))


def _standardised(rows: FloatArray) -> FloatArray:
    """Return the columns that change, of mean 0 and standard deviation 1.

    Raises:
        DoesNotApply: None does.
    """
    moving = rows[:, _changes(rows)]
    if not moving.shape[1]:
        raise DoesNotApply("nothing that a policy reads, or nothing that it writes, ever changes")
    return (moving - moving.mean(axis=0)) / moving.std(axis=0)

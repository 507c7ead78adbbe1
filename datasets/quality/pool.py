"""What the datasets that are compared have in common: one scale for all, so that numbers can be compared.

Episodes come one after the other and need not stay: sums, ranges and scatter are all that is kept of them,
and of a group some frames that stand for it, where every frame is compared with every other.
"""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply

FRAMES = 2048  # of a group at most, for what compares every frame with every other
_FEW = 2  # values that an entry takes if it is a switch
_STILL = 1e-9  # a standard deviation below this is that of a constant


Embedding = Callable[[FloatArray], FloatArray]


class Spread:
    """Number, mean and scatter Σ (x − mean)(x − mean)ᵀ of rows that come in parts.

    Source: Chan, Golub & LeVeque 1983, "Algorithms for computing the sample variance".
    """

    def __init__(self) -> None:
        """Begin without a row."""
        self.count, self.mean, self.scatter = 0, np.zeros(1), np.zeros((1, 1))

    def add(self, rows: FloatArray) -> None:
        """Take rows in, `(N, d)`."""
        mean, total = rows.mean(axis=0), self.count + len(rows)
        away, between = rows - mean, mean - self.mean
        self.scatter = (
            self.scatter + away.T @ away + np.outer(between, between) * self.count * len(rows) / total
        )
        self.mean = self.mean + between * len(rows) / total
        self.count = total


class Extent:
    """Lowest and highest value of each entry of rows that come in parts, and a few different ones."""

    def __init__(self) -> None:
        """Begin without a row."""
        self.values: list[FloatArray] = []

    def add(self, rows: FloatArray) -> None:
        """Take rows in, `(N, d)`."""
        known = self.values or [np.empty(0)] * rows.shape[1]
        both = (np.unique(np.append(*each)) for each in zip(known, rows.T, strict=True))
        self.values = [each if len(each) <= _FEW else each[[0, 1, -1]] for each in both]

    @property
    def range(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest value of each entry, `(d,)` each; the same for a switch."""
        low = np.array([each[0] for each in self.values])
        return low, np.array([each[-1] if len(each) > _FEW else each[0] for each in self.values])


def embed(spread: Spread, most: int | None = None) -> Embedding:
    """Return the linear map of rows onto few numbers of about unit size, `(N, d)` → `(N, m)`.

    y = (x − mean) / std · directions: standardised, then principal components, most variance first; entries
    that never change are left out.

    Args:
        spread: Of the rows, `(N, d)`.
        most: Keep at most this many principal components; None keeps the standardised entries themselves.

    Raises:
        DoesNotApply: Nothing in the rows changes.
    """
    mean, scale = spread.mean, np.sqrt(np.diag(spread.scatter) / spread.count)
    varies = scale > _STILL * np.maximum(1.0, np.abs(mean))
    if not varies.any():
        raise DoesNotApply("nothing in the columns ever changes")
    scale = np.where(varies, scale, np.inf)
    directions = np.eye(len(scale))[:, varies]
    if most is not None:
        _, vectors = np.linalg.eigh(spread.scatter / np.outer(scale, scale))
        directions = vectors[:, ::-1][:, : min(most, int(varies.sum()))]
    return lambda values: (values - mean) / scale @ directions


class ObservationPool:
    """All episodes of datasets with the same columns.

    Attributes:
        margin: Distance to keep [m].
        frames: Of each group, for what compares every frame with every other: as many of one as of another.
    """

    def __init__(self, margin: float = 0.1, frames: int = FRAMES):
        """Begin without an episode."""
        self.margin, self.frames = margin, frames
        self._parts: dict[str, Any] = {
            "action": Extent(),
            "inputs": Extent(),
            "configuration": Spread(),
            "observation": Spread(),
            "relative_action": Spread(),
        }
        self._missing: dict[str, DoesNotApply] = {}

    def add(self, episode: Demonstration) -> None:
        """Take an episode in."""
        for name, part in self._parts.items():
            if name in self._missing:
                continue
            try:
                part.add(episode.matrix(name) if name == "action" else getattr(episode, name))
            except DoesNotApply as error:
                self._missing[name] = error

    @cached_property
    def action_range(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest value of each entry of the action, `(a,)` each; the same for a switch."""
        return self._part("action").range

    @cached_property
    def input_scale(self) -> FloatArray:
        """Largest input of each axis, `(u,)`."""
        return np.array([np.abs(each).max() for each in self._part("inputs").values])

    @cached_property
    def configurations(self) -> Embedding:
        """Standardised configurations."""
        return embed(self._part("configuration"))

    @cached_property
    def observations(self) -> Embedding:
        """At most eight principal components of what a policy reads."""
        return embed(self._part("observation"), most=8)

    @cached_property
    def actions(self) -> Embedding:
        """Standardised relative actions."""
        return embed(self._part("relative_action"))

    @cached_property
    def action_components(self) -> Embedding:
        """At most eight principal components of the relative actions."""
        return embed(self._part("relative_action"), most=8)

    def _part(self, name: str) -> Any:
        if name in self._missing:
            raise self._missing[name]
        return self._parts[name]


class Sample:
    """Some frames of some episodes of a group.

    Attributes:
        episodes: What is left of each.
        places: Which episodes of the group they are.
    """

    def __init__(self) -> None:
        """Begin without a frame."""
        self.episodes: list[Demonstration] = []
        self.places: list[int] = []

    def add(self, episode: Demonstration, frames: IntArray, place: int) -> None:
        """Take some frames of an episode in, if there are any."""
        if len(frames):
            self.episodes.append(episode.some(frames))
            self.places.append(place)

    def points(self, read: Callable[[Demonstration], FloatArray]) -> FloatArray:
        """Return what is read of all frames, `(N, d)`."""
        return np.vstack([read(episode) for episode in self.episodes])

    @property
    def owner(self) -> IntArray:
        """Which episode of the group a frame is from, `(N,)`."""
        return np.repeat(self.places, [episode.count for episode in self.episodes])

    def mean_of_each(self, values: FloatArray, count: int) -> FloatArray:
        """Return the mean of the frames' values for each of E = `count` episodes, NaN where it has none."""
        known, owner = np.isfinite(values), self.owner
        counts = np.bincount(owner[known], minlength=count)
        sums = np.bincount(owner[known], weights=values[known], minlength=count)
        return np.divide(sums, counts, out=np.full(count, np.nan), where=counts > 0)


def frames_of(lengths: Sequence[int], most: int) -> list[IntArray]:
    """Return which frames stand for each episode: evenly spaced, as many of all that are long enough.

    Args:
        lengths: Of the episodes of one group [frames].
        most: Frames of all episodes together; all of them where there are fewer.
    """
    whole = np.array(lengths)
    shares, left = np.zeros_like(whole), min(most, int(whole.sum()))
    order = np.argsort(whole, kind="stable")
    for done, place in enumerate(order):  # the shorter ones whole, the rest alike, ±1
        shares[place] = min(int(whole[place]), left // (len(order) - done))
        left -= int(shares[place])
    pairs = zip(whole, shares, strict=True)
    return [np.linspace(0, length - 1, share).round().astype(int) for length, share in pairs]

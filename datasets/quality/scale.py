"""The scale of compared datasets: one for all, so that their numbers can be compared.

Episodes come one after the other and need not stay: sums, ranges and scatter are all that is kept of them.
"""

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply

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
        """Add rows, `(N, d)`."""
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
        """Add rows, `(N, d)`."""
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

    y = (x − mean) / std · directions: standardised, then at most `most` principal components, most variance
    first (None: the standardised entries themselves). Entries that never change are left out; `DoesNotApply`
    where none changes.
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


class Scale:
    """The scale of all episodes of datasets with the same columns; `margin` is the distance to keep [m]."""

    def __init__(self, margin: float = 0.1):
        """Begin without an episode."""
        self.margin = margin
        self.widest_opening = 0.0
        """Largest opening of any gripper, of the episodes that tell one."""
        self._parts: dict[str, Any] = {"action": Extent(), "inputs": Extent()}
        self._parts |= {name: Spread() for name in ("configuration", "observation", "relative_action")}

    def add(self, episode: Demonstration) -> None:
        """Add an episode; a part that one episode lacks is missing for all."""
        with suppress(DoesNotApply):
            self.widest_opening = max(self.widest_opening, float(np.abs(episode.grippers).max()))
        for name, part in self._parts.items():
            if isinstance(part, DoesNotApply):
                continue
            try:
                part.add(episode.matrix(name) if name == "action" else getattr(episode, name))
            except DoesNotApply as error:
                self._parts[name] = error

    @cached_property
    def input_scale(self) -> FloatArray:
        """Largest input of each axis, `(u,)`."""
        return np.array([np.abs(each).max() for each in self.part("inputs").values])

    def part(self, name: str) -> Any:
        """Return the `Spread` or the `Extent` of a part."""
        part = self._parts[name]
        if isinstance(part, DoesNotApply):
            raise part
        return part

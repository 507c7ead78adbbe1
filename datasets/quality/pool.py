"""What the datasets that are compared have in common: one scale for all, so that numbers can be compared."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.demonstration import Demonstration, DoesNotApply

_FEW = 2  # values that an entry takes if it is a switch
_STILL = 1e-9  # a standard deviation below this is that of a constant


Embedding = Callable[[FloatArray], FloatArray]


def embed(rows: FloatArray, most: int | None = None) -> Embedding:
    """Return the linear map of rows onto few numbers of about unit size, `(N, d)` → `(N, m)`.

    y = (x − mean) / std · directions: standardised, then principal components, most variance first; entries
    that never change are left out.

    Args:
        rows: `(N, d)`.
        most: Keep at most this many principal components; None keeps the standardised entries themselves.

    Raises:
        DoesNotApply: Nothing in the rows changes.
    """
    mean, scale = rows.mean(axis=0), rows.std(axis=0)
    varies = scale > _STILL * np.maximum(1.0, np.abs(mean))
    if not varies.any():
        raise DoesNotApply("nothing in the columns ever changes")
    scale = np.where(varies, scale, np.inf)
    directions = np.eye(len(scale))[:, varies]
    if most is not None:
        standard = (rows - mean) / scale
        _, vectors = np.linalg.eigh(standard.T @ standard)
        directions = vectors[:, ::-1][:, : min(most, int(varies.sum()))]
    return lambda values: (values - mean) / scale @ directions


@dataclass(frozen=True)
class Pool:
    """All episodes of datasets with the same columns.

    Attributes:
        episodes: Of all of them.
        margin: Distance to keep [m].
        frames: Of each group, for what compares every frame with every other: as many of one as of another.
    """

    episodes: Sequence[Demonstration]
    margin: float = 0.1
    frames: int = 2048

    @cached_property
    def action_range(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest value of each entry of the action, `(a,)` each; the same for a switch."""
        rows = np.vstack([episode.matrix("action") for episode in self.episodes])
        low, high = rows.min(axis=0), rows.max(axis=0)
        switch = np.array([len(np.unique(column)) <= _FEW for column in rows.T])
        return low, np.where(switch, low, high)

    @cached_property
    def input_scale(self) -> FloatArray:
        """Largest input of each axis, `(u,)`."""
        return np.max([np.abs(episode.inputs).max(axis=0) for episode in self.episodes], axis=0)

    @cached_property
    def configurations(self) -> Embedding:
        """Standardised configurations."""
        return embed(np.vstack([episode.configuration for episode in self.episodes]))

    @cached_property
    def observations(self) -> Embedding:
        """At most eight principal components of what a policy reads."""
        return embed(np.vstack([episode.observation for episode in self.episodes]), most=8)

    @cached_property
    def actions(self) -> Embedding:
        """Standardised relative actions."""
        return embed(np.vstack([episode.relative_action for episode in self.episodes]))

    @cached_property
    def action_components(self) -> Embedding:
        """At most eight principal components of the relative actions."""
        return embed(np.vstack([episode.relative_action for episode in self.episodes]), most=8)

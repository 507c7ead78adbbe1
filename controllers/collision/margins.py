"""How far every pair has to keep apart now."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.model import CollisionModel


@dataclass(frozen=True)
class Margins:
    """The margin of every pair: what is wanted, or what the pair can keep.

    What the hand holds may have stood nearer to something when it was grasped. Then it may stay as near, and
    from there only come away: `m ← min(m_wanted, max(m, d))`; a grasp moves nothing.

    Attributes:
        values: of each pair [m], (P,).
        wanted: of the pairs with what the hand holds [m], (H,).
        rows: where these are, (H,).
        names: of their two shapes, (H,) of (str, str).
        unknown: whether something was grasped whose distances were not seen yet.
    """

    values: FloatArray
    wanted: FloatArray
    rows: IntArray
    names: tuple[tuple[str, str], ...]
    unknown: bool

    @classmethod
    def of(
        cls, collision: CollisionModel, margin: float, work_margin: float, before: Self | None = None
    ) -> Self:
        """Return the margins of the pairs.

        Args:
            collision: the pairs.
            margin: wanted between shapes [m].
            work_margin: wanted between tool shapes and work surfaces [m].
            before: of the same robot among other obstacles; what was held then has come as far away as it
                had.
        """
        rows = collision.held
        values = np.minimum(np.where(collision.work, work_margin, margin), collision.largest_margin)
        wanted, names = values[rows], tuple(collision.pairs[row] for row in rows)
        kept = {} if before is None else before.of_held()
        values[rows] = [kept.get(name, -np.inf) for name in names]
        return cls(values, wanted, rows, names, unknown=not all(name in kept for name in names))

    def of_held(self) -> dict[tuple[str, str], float]:
        """Return the margins of what is held, by the names of each pair [m]; none where they are unknown."""
        return {} if self.unknown else dict(zip(self.names, self.values[self.rows].tolist(), strict=True))

    def seen(self, distances: FloatArray) -> Self:
        """Return the margins after the distances of all pairs were seen, (P,) [m]."""
        if not len(self.rows):
            return self
        values = self.values.copy()
        values[self.rows] = np.minimum(self.wanted, np.maximum(values[self.rows], distances[self.rows]))
        return replace(self, values=values, unknown=False)

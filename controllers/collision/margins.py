"""How far every pair has to keep apart now."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel


class Margins:
    """The margin of every pair: what is wanted, or what the pair can keep.

    What the hand holds may have stood nearer to something when it was grasped. Then it may stay as near, and
    from there only come away: `m ← min(m_wanted, max(m, d))`; a grasp moves nothing.

    Args:
        collision: the pairs.
        margin: wanted between shapes [m].
        work_margin: wanted between tool shapes and work surfaces [m].
        before: of the same robot among other obstacles; what was held then has come as far away as it had.

    Attributes:
        values: of each pair [m], (P,); changed in place.
    """

    def __init__(
        self, collision: CollisionModel, margin: float, work_margin: float, before: "Margins | None" = None
    ) -> None:
        wanted = np.where(collision.work, work_margin, margin)
        self.values = np.minimum(wanted, collision.largest_margin)
        self._held = collision.held
        self._wanted = self.values[self._held]
        self._names = [collision.pairs[row] for row in self._held]
        kept = {} if before is None else before.of_held()
        self.values[self._held] = [kept.get(name, -np.inf) for name in self._names]
        self._unknown = not all(name in kept for name in self._names)

    @property
    def unknown(self) -> bool:
        """Whether something was grasped whose distances were not seen yet."""
        return self._unknown

    def of_held(self) -> dict[tuple[str, str], float]:
        """Return the margins of what is held, by the names of each pair [m]; none where they are unknown."""
        return {} if self._unknown else dict(zip(self._names, self.values[self._held].tolist(), strict=True))

    def see(self, distances: FloatArray) -> None:
        """Take the distances of all pairs now, (P,) [m]."""
        held = self._held
        if len(held):
            self.values[held] = np.minimum(self._wanted, np.maximum(self.values[held], distances[held]))
            self._unknown = False

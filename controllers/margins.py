"""How far every pair has to keep apart now."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision import CollisionModel


class Margins:
    """The margin of every pair: what is wanted, or what the pair can keep.

    What the hand holds may have stood nearer to something when it was grasped. Then it may stay as near, and
    from there only come away: `m ← min(m_wanted, max(m, d))`; a grasp moves nothing.

    Args:
        collision: the pairs.
        margin: wanted between shapes [m].
        work_margin: wanted between tool shapes and work surfaces [m].

    Attributes:
        values: of each pair [m], (P,); changed in place.
    """

    def __init__(self, collision: CollisionModel, margin: float, work_margin: float) -> None:
        wanted = np.where(collision.work, work_margin, margin)
        self.values = np.minimum(wanted, collision.largest_margin)
        self._held = collision.held
        self._wanted = self.values[self._held]
        self._unknown = bool(len(self._held))
        self.values[self._held] = -np.inf

    @property
    def unknown(self) -> bool:
        """Whether something was grasped whose distances were not seen yet."""
        return self._unknown

    def see(self, distances: FloatArray) -> None:
        """Take the distances of all pairs now, (P,) [m]."""
        held = self._held
        if len(held):
            self.values[held] = np.minimum(self._wanted, np.maximum(self.values[held], distances[held]))
            self._unknown = False

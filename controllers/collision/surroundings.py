"""The surroundings of a controller: pairs of the robot's shapes and obstacles, and their distances."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.shape import Obstacle


@dataclass(frozen=True)
class Surroundings:
    """The obstacles of a controller, which come and go, and the margin of every pair.

    What the hand holds may have stood nearer to something when it was grasped. Then it may stay as near, and
    from there only come away: `m ← min(m_wanted, max(m, d))`; a grasp moves nothing.
    """

    collision: CollisionModel  # the pairs that keep apart; of the last scene that made sense
    margin: float  # wanted between shapes [m]
    work_margin: float  # wanted between tool shapes and work surfaces [m]
    margins: FloatArray  # of each pair [m], (P,): what is wanted, or what the pair can keep
    unknown: bool  # whether something was grasped whose distances were not seen yet
    make_sense: bool = True  # whether what was seen last does; else the robot has to brake

    @classmethod
    def of(
        cls,
        collision: CollisionModel,
        margin: float = 0.0,
        work_margin: float = 0.0,
        kept: dict[tuple[str, str], float] | None = None,
    ) -> Self:
        """Return the surroundings with some pairs.

        Args:
            collision: the pairs.
            margin: wanted between shapes [m].
            work_margin: wanted between tool shapes and work surfaces [m].
            kept: margins of what was held before, by the names of each pair [m].
        """
        margins = _wanted(collision, margin, work_margin)
        held = [(kept or {}).get(collision.pairs[row], -np.inf) for row in collision.held]
        margins[collision.held] = held
        return cls(collision, margin, work_margin, margins, unknown=-np.inf in held)

    def among(self, obstacles: tuple[Obstacle, ...]) -> Self:
        """Return the surroundings with the obstacles as they are now; what is held keeps its margins."""
        try:
            collision = self.collision.among(obstacles)
        except HandrailError:
            return replace(self, make_sense=False)
        if collision is self.collision:
            return self if self.make_sense else replace(self, make_sense=True)
        rows = [] if self.unknown else self.collision.held.tolist()
        kept = {self.collision.pairs[row]: float(self.margins[row]) for row in rows}
        return self.of(collision, self.margin, self.work_margin, kept)

    def seen(self, distances: FloatArray) -> Self:
        """Return the surroundings after the distances of all pairs were seen, (P,) [m]."""
        held = self.collision.held
        if not len(held):
            return self
        margins, wanted = self.margins.copy(), _wanted(self.collision, self.margin, self.work_margin)
        margins[held] = np.minimum(wanted[held], np.maximum(margins[held], distances[held]))
        return replace(self, margins=margins, unknown=False)

    def known_at(self, q: FloatArray) -> Self:
        """Return the surroundings in which every margin is known, at a configuration, (n,)."""
        return self.seen(self.collision.values(q[None])[0]) if self.unknown else self

    def smallest(self, distances: FloatArray) -> tuple[float, float]:
        """Return the smallest distance, tools at work surfaces left out, and the smallest of those [m]."""
        apart, work = self.collision.apart_and_work
        if not len(work):
            return float(distances.min(initial=np.inf)), np.inf
        return float(distances[apart].min(initial=np.inf)), float(distances[work].min())


def _wanted(collision: CollisionModel, margin: float, work_margin: float) -> FloatArray:
    return np.minimum(np.where(collision.work, work_margin, margin), collision.largest_margin)

"""Signed distances and their gradients, by the compiled core; coal measures shapes whose cores meet."""

from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.shape_pairs import ShapePairs
from handrail.controllers.collision.slacks import MOVING, OWN, STANDING
from handrail.controllers.core.library import functions
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle


@dataclass(frozen=True)
class Distances:
    """Signed distances of P pairs at K configurations, and the gradients of those that are near."""

    values: FloatArray  # signed distances [m], negative when they overlap, (K, P)
    near: IntArray  # indices (node, pair) of the R entries whose gradient is given, (R, 2)
    gradients: FloatArray  # derivatives of those entries by q, (R, n)


class CollisionModel:
    """Measures the pairs that must keep apart; see shape_pairs.py for which these are.

    Attributes:
        pairs: names of the two shapes of each pair, (P,) of (str, str).
        work: which pairs are a tool shape against a work surface, (P,).
        apart_and_work: rows of the other pairs, and of those.
        largest_margin: the largest margin that a pair can keep [m], (P,).
        held: rows of the pairs with something that the hand holds, (H,).
        kinds: whether a pair is OWN, STANDING or MOVING (slacks.py), (P,).
        memory: the compiled core's `Scene`.
    """

    def __init__(self, model: RobotModel, obstacles: tuple[Obstacle, ...] = ()) -> None:
        self._robot = model
        self._shapes = ShapePairs(model, obstacles)
        self._kept = _kept(obstacles)
        self.pairs = self._shapes.names
        self.work = self._shapes.work
        self.apart_and_work = np.flatnonzero(~self.work), np.flatnonzero(self.work)
        self.largest_margin = self._shapes.largest_margin
        self.held = self._shapes.held
        self.memory = self._shapes.memory
        self.memory.fields.now_changes = -1
        self.kinds = self.memory.slack
        self._everything = np.full(self.size, np.inf)
        self._take_kinds()

    @property
    def size(self) -> int:
        """Number of pairs P."""
        return len(self.pairs)

    def distances(
        self, q: FloatArray, within: FloatArray | float = np.inf, times: FloatArray | None = None
    ) -> Distances:
        """Return the signed distances along a trajectory, and gradients of those below `within`.

        A pair that cannot come below its limit on its way from the first configuration, or from the one
        before, is not measured: its value is a lower bound (core/scene.c).

        Args:
            q: configurations, (K, n).
            within: the largest distance whose gradient is wanted, for all pairs or each, (P,) [m].
            times: of the configurations from now on, (K,) [s]; moving obstacles are where they will be then.
        """
        q = np.ascontiguousarray(q, dtype=np.float64)
        count, n = q.shape
        times = np.zeros(count) if times is None else times
        limits = np.broadcast_to(np.asarray(within, dtype=np.float64), self.size).copy()
        values = np.empty((count, self.size))
        near, gradients = np.empty((count * self.size, 2), dtype=np.int64), np.empty((count * self.size, n))
        found = functions().scene_distances(
            self.memory, count, q, times, limits, None, None, 0, values, near, gradients
        )
        self.check()
        return Distances(values, near[:found].copy(), gradients[:found].copy())

    def values(
        self,
        q: FloatArray,
        times: FloatArray | None = None,
        now: tuple[FloatArray, FloatArray] | None = None,
        within: FloatArray | None = None,
    ) -> FloatArray:
        """Return the signed distances at configurations (K, n) and times (K,), (K, P) [m].

        Args:
            q: configurations.
            times: from now on [s].
            now: a configuration, (n,), and its distances, (P,), if they are known: pairs that cannot come
                below their limit then get a lower bound instead, infinitely cheaper.
            within: distance below which a pair's own value is wanted then, (P,) [m].
        """
        q = np.ascontiguousarray(q, dtype=np.float64)
        times, values = np.zeros(len(q)) if times is None else times, np.empty((len(q), self.size))
        limits = self._everything if within is None else within
        functions().scene_values(self.memory, len(q), q, times, *(now or (None, None)), limits, values)
        self.check()
        return values

    def check(self) -> None:
        """Raise what went wrong while coal measured."""
        failure, self._shapes.failure = self._shapes.failure, None
        if failure is not None:
            raise failure

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now and how fast they move."""
        if (kept := _kept(obstacles)) != self._kept:
            expected, got = (", ".join(str(name) for name, *_ in things) for things in (self._kept, kept))
            raise HandrailError(f"obstacles: expected {expected} as they were, got {got}")
        if self._shapes.update_scene(obstacles):
            self._take_kinds()

    def _take_kinds(self) -> None:
        self.kinds[:] = np.where(self.memory.speed > 0.0, MOVING, STANDING)
        self.kinds[: len(self._robot.description.self_pairs)] = OWN

    def among(self, obstacles: tuple[Obstacle, ...]) -> "CollisionModel":
        """Return the model as the obstacles are now: this one, or another when some came, went or changed."""
        if _kept(obstacles) != self._kept:
            return CollisionModel(self._robot, obstacles)
        self.update_scene(obstacles)
        return self


def _kept(obstacles: tuple[Obstacle, ...]) -> tuple[tuple[object, ...], ...]:
    """Return what of every obstacle stays the same while it moves."""
    return tuple(obstacle.kept for obstacle in obstacles)

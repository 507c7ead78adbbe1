"""Signed distances and their gradients: coal's shapes on pinocchio's model."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.distance_kernels import gradients, lower_bounds, raise_bounds, take
from handrail.controllers.collision.pair_data import PairData
from handrail.controllers.collision.shape_pairs import ShapePairs
from handrail.controllers.collision.slacks import MOVING, OWN, STANDING
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle

_STRETCH = 13  # configurations after which all pairs are measured again


@dataclass(frozen=True)
class Distances:
    """Signed distances of P pairs at K configurations, and the gradients of those that are near.

    Attributes:
        values: signed distances [m], negative when they overlap, (K, P).
        near: indices (node, pair) of the R entries whose gradient is given, (R, 2).
        gradients: derivatives of those entries by q, (R, n).
    """

    values: FloatArray
    near: IntArray
    gradients: FloatArray


class CollisionModel:
    """Measures the pairs that must keep apart.

    See shape_pairs.py for which these are, and distance_kernels.py for distances and their gradients.

    Attributes:
        pairs: names of the two shapes of each pair, (P,) of (str, str).
        work: which pairs are a tool shape against a work surface, (P,).
        largest_margin: the largest margin that a pair can keep [m], (P,).
        held: rows of the pairs with something that the hand holds, (H,).
        kinds: whether a pair is OWN, STANDING or MOVING (slacks.py), (P,).
    """

    def __init__(self, model: RobotModel, obstacles: tuple[Obstacle, ...] = ()) -> None:
        self._robot = model
        self._model = model.pinocchio
        self._shapes = ShapePairs(model, obstacles)
        self._geometry = self._shapes.geometry
        self._kept = _kept(obstacles)
        self._moving: list[Obstacle] = []
        self.pairs = self._shapes.names
        self.work = self._shapes.work
        self.largest_margin = self._shapes.largest_margin
        self.held = self._shapes.held
        self._moves = self._shapes.moves  # (P, 2, n)
        self._motion_bounds = self._shapes.motion_bounds  # (n, P), which `update_scene` brings up to date
        self._data = self._model.createData()
        self._every = np.arange(len(self.pairs))
        neutral = pin.neutral(self._model)
        self._all, self._along, self._after = (
            PairData(self._model, self._data, self._geometry, neutral) for _ in range(3)
        )
        self._last: tuple[FloatArray, FloatArray] | None = None  # trajectory, and distances along it
        self._now: tuple[FloatArray, ...] | None = None  # first of these, and what was found there
        self._take_speeds(obstacles)

    @property
    def size(self) -> int:
        """Number of pairs P."""
        return len(self.pairs)

    @property
    def any_moving(self) -> bool:
        """Whether any obstacle moves."""
        return bool(self._moving)

    def distances(
        self, q: FloatArray, within: FloatArray | float = np.inf, times: FloatArray | None = None
    ) -> Distances:
        """Return the signed distances along a trajectory, and gradients of those below `within`.

        On every stretch of the way a pair that cannot come below its limit is measured at the beginning only;
        after that its value is a lower bound: `d(q_k) ≥ d(q_0) - Σ_j L_j |q_k - q_0|_j - |v_obstacle| t_k`,
        or what the last trajectory's distances leave of it: the next one is seldom far from it.

        Args:
            q: configurations, (K, n).
            within: the largest distance whose gradient is wanted, for all pairs or each, (P,) [m].
            times: of the configurations from now on, (K,) [s]; moving obstacles are where they will be then.
        """
        if not self.size:
            nothing = np.zeros((0, 2), dtype=int), np.zeros((0, self._model.nv))
            return Distances(np.zeros((len(q), 0)), *nothing)
        times = np.zeros(len(q)) if times is None else times
        limits = within if isinstance(within, np.ndarray) else np.full(self.size, float(within))
        witnesses = np.empty((len(q), self.size, 9))
        jacobians = np.empty((len(q), 6, self._model.nv))
        values = np.empty((len(q), self.size))
        for begin in range(0, len(q), _STRETCH):
            stretch = slice(begin, begin + _STRETCH)
            first = slice(begin, begin + 1)
            found = witnesses[first], values[first], jacobians[first]
            if begin or not self._recall(q[0], found):
                self._measure(self._all, self._every, q[first], times[first], *found)
            if not begin and not self._moving:
                self._now = q[0].copy(), *(each.copy() for each in found)
            ahead = times[stretch] - times[begin]
            bounds, close = lower_bounds(
                values[begin], q[begin], q[stretch], ahead, self._motion_bounds, self._speeds, limits
            )
            if self._last is not None and self._last[0].shape == q.shape:
                there, known = self._last[0][stretch], self._last[1][stretch]
                close = raise_bounds(bounds, q[stretch], known, there, self._motion_bounds, limits)
            chosen = self._along.select(close)
            if len(chosen):
                after = slice(begin + 1, begin + len(bounds))
                found = witnesses[after], bounds[1:], jacobians[after]
                self._measure(self._along, chosen, q[after], times[after], *found)
            values[stretch] = bounds
        self._last = None if self._moving else (q.copy(), values.copy())
        near, rows = gradients(witnesses, jacobians, self._moves, values, limits)
        return Distances(values, near, rows)

    def _recall(self, q: FloatArray, found: tuple[FloatArray, ...]) -> bool:
        """Write what was found at a configuration, (n,), if it is the one that was measured last."""
        if self._now is None or not np.array_equal(self._now[0], q):
            return False
        for target, known in zip(found, self._now[1:], strict=True):
            target[:] = known
        return True

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
        if not self.size:
            return np.empty((len(q), 0))
        times = np.zeros(len(q)) if times is None else times
        if now is None:
            data, chosen, values = self._all, self._every, np.empty((len(q), self.size))
        else:
            data, (start, there) = self._after, now
            values, close = lower_bounds(there, start, q, times, self._motion_bounds, self._speeds, within)
            if not close.any():
                return values
            chosen = data.select(close)
        witnesses = np.empty((len(q), self.size, 9))
        self._measure(data, chosen, q, times, witnesses, values)
        return values

    def _measure(
        self,
        data: PairData,
        chosen: IntArray,
        q: FloatArray,
        times: FloatArray,
        witnesses: FloatArray,
        values: FloatArray,
        jacobians: FloatArray | None = None,
    ) -> None:
        """Let coal compute some pairs at configurations, with moving obstacles where they are then.

        Args:
            data: of the pairs.
            chosen: their indices.
            q: configurations, (K, n).
            times: of them from now on, (K,) [s].
            witnesses: filled with normals and nearest points, (K, P, 9).
            values: filled with signed distances, (K, P) [m].
            jacobians: filled with the joints' spatial Jacobians, if wanted, (K, 6, n).
        """
        model, kinematics, geometry = self._model, self._data, self._geometry
        for k in range(len(q)):
            if self._moving:
                for obstacle in self._moving:
                    self._shapes.place(obstacle, times[k])
            pin.computeDistances(model, kinematics, geometry, data.geometry, q[k])
            take(data.read(), chosen, k, witnesses, values)
            if jacobians is not None:
                jacobians[k] = pin.computeJointJacobians(model, kinematics)

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now and how fast they move."""
        if (kept := _kept(obstacles)) != self._kept:
            expected, got = (", ".join(str(name) for name, *_ in things) for things in (self._kept, kept))
            raise HandrailError(f"obstacles: expected {expected} as they were, got {got}")
        moved = self._shapes.update_scene(obstacles)
        if not moved:
            return
        self._now = None
        if self._last is not None:
            for obstacle in moved:
                self._last[1][:, self._shapes.rows[obstacle.name]] = -np.inf
        self._take_speeds(obstacles)

    def _take_speeds(self, obstacles: tuple[Obstacle, ...]) -> None:
        self._moving = [obstacle for obstacle in obstacles if obstacle.velocity.any()]
        self._speeds = np.zeros(self.size)
        for obstacle in self._moving:
            self._speeds[self._shapes.rows[obstacle.name]] = np.linalg.norm(obstacle.velocity)
        self.kinds = np.where(self._speeds > 0.0, MOVING, STANDING)
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

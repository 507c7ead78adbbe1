"""Signed distances and their gradients: coal's shapes on pinocchio's model."""

from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import BoolArray, FloatArray, IntArray, frozen
from handrail.controllers.errors import HandrailError
from handrail.controllers.levers import all_lever_arms
from handrail.controllers.model import RobotModel
from handrail.controllers.pair_data import PairData
from handrail.controllers.shape import Obstacle, Shape
from handrail.controllers.witnesses import gradients, lower_bounds, measured, raise_bounds

FLOOR = "floor"
_STRETCH = 13  # configurations after which all pairs are measured again
_FAR = 0.15  # a pair that stays farther apart than this need not be measured exactly [m]


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
    """The pairs that must keep apart: robot shapes with each other, the floor and the obstacles.

    See witnesses.py for the distance of a pair and its gradient.

    Attributes:
        pairs: names of the two shapes of each pair, (P,) of (str, str).
        work: which pairs are a tool shape against a work surface, (P,).
        largest_margin: the largest margin that a pair can keep [m], (P,).
    """

    def __init__(self, model: RobotModel, obstacles: tuple[Obstacle, ...] = ()) -> None:
        self._model = model.pinocchio
        self._geometry = pin.GeometryModel()
        description = model.description
        robot = {
            placed.name: self._add(placed.name, model.frame_id(placed.frame), placed.shape, placed.placement)
            for placed in description.collision
        }
        tools = {placed.name for placed in description.collision if placed.tool}
        scene = self._add_scene(obstacles)
        self._obstacles = {obstacle.name: scene[obstacle.name] for obstacle in obstacles}
        self._moving: list[tuple[pin.GeometryObject, Obstacle]] = []
        work_surfaces = {obstacle.name for obstacle in obstacles if obstacle.work_surface}
        self.pairs = (
            *description.self_pairs,
            *((name, FLOOR) for name in description.floor_shapes),
            *((name, obstacle.name) for name in description.scene_shapes for obstacle in obstacles),
        )
        everything = robot | scene
        for first, second in self.pairs:
            self._geometry.addCollisionPair(pin.CollisionPair(everything[first], everything[second]))
        self.work: BoolArray = frozen([a in tools and b in work_surfaces for a, b in self.pairs], dtype=bool)
        other = np.full(len(self.pairs) - len(description.self_pairs), np.inf)
        self.largest_margin: FloatArray = frozen(np.concatenate([description.self_margins, other]))
        self._data = self._model.createData()
        self._moves = self._pair_moves()  # (P, 2, n)
        self._levers = np.ascontiguousarray(self._pair_levers(model))  # (n, P)
        self._every = np.arange(len(self.pairs))
        self._far = np.full(len(self.pairs), _FAR)
        neutral = pin.neutral(self._model)
        self._all, self._along, self._after = (
            PairData(self._model, self._data, self._geometry, neutral) for _ in range(3)
        )
        self.observe(obstacles)

    @property
    def size(self) -> int:
        """Number of pairs P."""
        return len(self.pairs)

    @property
    def moves(self) -> bool:
        """Whether any obstacle moves."""
        return bool(self._moving)

    def distances(
        self, q: FloatArray, reach: FloatArray | float = np.inf, times: FloatArray | None = None
    ) -> Distances:
        """Return the signed distances along a trajectory, and gradients of those below `reach`.

        On every stretch of the way a pair that cannot come below its reach is measured at the beginning only;
        after that its value is a lower bound: `d(q_k) ≥ d(q_0) - Σ_j L_j |q_k - q_0|_j - |v_obstacle| t_k`,
        or what the last trajectory's distances leave of it: the next one is seldom far from it.

        Args:
            q: configurations, (K, n).
            reach: the largest distance whose gradient is wanted, for all pairs or each, (P,) [m].
            times: of the configurations from now on, (K,) [s]; moving obstacles are where they will be then.
        """
        if not self.size:
            return _nothing(len(q), self._model.nv)
        times = np.zeros(len(q)) if times is None else times
        reaches = reach if isinstance(reach, np.ndarray) else np.full(self.size, float(reach))
        witnesses = np.empty((len(q), self.size, 9))
        jacobians = np.empty((len(q), 6, self._model.nv))
        values = np.empty((len(q), self.size))
        for begin in range(0, len(q), _STRETCH):
            stretch = slice(begin, begin + _STRETCH)
            first = slice(begin, begin + 1)
            self._measure(self._all, q[first], times[first], witnesses[first], jacobians[first])
            measured(witnesses[first], self._every, values[first])
            ahead = times[stretch] - times[begin]
            bounds, close = lower_bounds(
                values[begin], q[begin], q[stretch], ahead, self._levers, self._speeds, reaches
            )
            if self._last is not None and self._last[0].shape == q.shape:
                there, known = self._last[0][stretch], self._last[1][stretch]
                close = raise_bounds(bounds, q[stretch], known, there, self._levers, reaches)
            chosen = self._along.select(close)
            if len(chosen):
                after = slice(begin + 1, begin + len(bounds))
                self._measure(self._along, q[after], times[after], witnesses[after], jacobians[after])
            measured(witnesses[stretch], chosen, bounds)
            values[stretch] = bounds
        self._last = None if self._moving else (q.copy(), values)
        near, rows = gradients(witnesses, jacobians, self._moves, values, reaches)
        return Distances(values, near, rows)

    def values(
        self,
        q: FloatArray,
        times: FloatArray | None = None,
        now: tuple[FloatArray, FloatArray] | None = None,
        reach: FloatArray | None = None,
    ) -> FloatArray:
        """Return the signed distances at configurations (K, n) and times (K,), (K, P) [m].

        Args:
            q: configurations.
            times: from now on [s].
            now: a configuration, (n,), and its distances, (P,), if they are known: pairs that cannot come
                below their reach then get a lower bound instead, infinitely cheaper.
            reach: distance below which a pair's own value is wanted, (P,) [m]; 0.15 m when None.
        """
        if not self.size:
            return np.empty((len(q), 0))
        times = np.zeros(len(q)) if times is None else times
        if now is None:
            data, chosen, values = self._all, self._every, np.empty((len(q), self.size))
        else:
            data, (start, there) = self._after, now
            reach = self._far if reach is None else reach
            values, close = lower_bounds(there, start, q, times, self._levers, self._speeds, reach)
            if not close.any():
                return values
            chosen = data.select(close)
        witnesses = np.empty((len(q), self.size, 9))
        self._measure(data, q, times, witnesses)
        measured(witnesses, chosen, values)
        return values

    def _measure(
        self,
        data: "PairData",
        q: FloatArray,
        times: FloatArray,
        witnesses: FloatArray,
        jacobians: FloatArray | None = None,
    ) -> None:
        """Let coal compute some pairs at configurations, with moving obstacles where they are then.

        Args:
            data: of the pairs.
            q: configurations, (K, n).
            times: of them from now on, (K,) [s].
            witnesses: filled with normals and nearest points, (K, P, 9).
            jacobians: filled with the joints' spatial Jacobians, if wanted, (K, 6, n).
        """
        model, kinematics, geometry = self._model, self._data, self._geometry
        pairs, results = data.geometry, data.results
        for k in range(len(q)):
            if self._moving:
                self._move_obstacles(times[k])
            pin.computeDistances(model, kinematics, geometry, pairs, q[k])
            witnesses[k] = results.read()
            if jacobians is not None:
                jacobians[k] = pin.computeJointJacobians(model, kinematics)

    def _move_obstacles(self, time: float) -> None:
        """Put moving obstacles where they are after a time."""
        for geometry, obstacle in self._moving:
            geometry.placement = pin.SE3(
                np.array(obstacle.rotation), obstacle.position + time * obstacle.velocity
            )

    def observe(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now and how fast they move.

        Raises:
            HandrailError: they are not the obstacles that the model was built with.
        """
        names = tuple(obstacle.name for obstacle in obstacles)
        if names != tuple(self._obstacles):
            raise HandrailError(f"obstacles: expected {', '.join(self._obstacles)}, got {', '.join(names)}")
        self._moving = []
        self._last: tuple[FloatArray, FloatArray] | None = None
        for obstacle in obstacles:
            geometry = self._geometry.geometryObjects[self._obstacles[obstacle.name]]
            geometry.placement = pin.SE3(np.array(obstacle.rotation), np.array(obstacle.position))
            if obstacle.velocity.any():
                self._moving.append((geometry, obstacle))
        speeds = {obstacle.name: float(np.linalg.norm(obstacle.velocity)) for obstacle in obstacles}
        self._speeds = np.array([speeds.get(second, 0.0) for _, second in self.pairs])

    def _add_scene(self, obstacles: tuple[Obstacle, ...]) -> dict[str, int]:
        names = [obstacle.name for obstacle in obstacles]
        if len(set(names)) != len(names) or FLOOR in names:
            raise HandrailError(f"obstacle names: expected distinct names other than {FLOOR!r}, got {names}")
        floor = pin.GeometryObject(
            FLOOR, 0, pin.SE3.Identity(), coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
        )
        scene = {FLOOR: self._geometry.addGeometryObject(floor)}
        for obstacle in obstacles:
            scene[obstacle.name] = self._add(obstacle.name, 0, obstacle.shape, obstacle)
        return scene

    def _add(self, name: str, frame: int, shape: Shape, placement: object) -> int:
        translation = getattr(placement, "translation", None)
        if translation is None:
            translation = placement.position  # type: ignore[attr-defined]
        local = pin.SE3(np.array(placement.rotation), np.array(translation))  # type: ignore[attr-defined]
        parent = self._model.frames[frame]
        thing = pin.GeometryObject(name, parent.parentJoint, parent.placement * local, _coal_shape(shape))
        return self._geometry.addGeometryObject(thing)

    def _pair_moves(self) -> FloatArray:
        """Return which coordinates move the two shapes of every pair: 1 or 0, (P, 2, n)."""
        moved = np.zeros((self._model.njoints, self._model.nv))
        for joint in range(1, self._model.njoints):
            moved[joint] = moved[self._model.parents[joint]]
            moved[joint, self._model.joints[joint].idx_v] = 1.0
        joints = [thing.parentJoint for thing in self._geometry.geometryObjects]
        pairs = [(joints[pair.first], joints[pair.second]) for pair in self._geometry.collisionPairs]
        return moved[np.array(pairs, dtype=int).reshape(-1, 2)]

    def _pair_levers(self, model: RobotModel) -> FloatArray:
        """Return how far a unit of each coordinate can bring a pair together at most, (n, P) [m].

        A coordinate that moves both shapes alike does not; of one that moves a single shape it is the
        shape's lever arm.
        """
        arms = all_lever_arms(model)
        none = np.zeros(model.size)
        either = (
            self._moves[:, 0] != self._moves[:, 1] if self.size else np.zeros((0, model.size), dtype=bool)
        )
        longer = [np.maximum(arms.get(a, none), arms.get(b, none)) for a, b in self.pairs]
        return (either * np.array(longer).reshape(-1, model.size)).T


def _nothing(count: int, size: int) -> Distances:
    """Return the distances of no pairs at all at `count` configurations."""
    return Distances(np.zeros((count, 0)), np.zeros((0, 2), dtype=int), np.zeros((0, size)))


def _coal_shape(shape: Shape) -> coal.ShapeBase:
    make = {"box": coal.Box, "capsule": coal.Capsule, "sphere": coal.Sphere, "cylinder": coal.Cylinder}
    return make[shape.kind](*(float(length) for length in shape.size))

"""Signed distances and their gradients: coal's shapes on pinocchio's model."""

from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import BoolArray, FloatArray, IntArray, frozen
from handrail.controllers.errors import HandrailError
from handrail.controllers.model import RobotModel
from handrail.controllers.shape import Obstacle, Shape

FLOOR = "floor"


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

    For a pair with nearest points p₁, p₂ and unit normal n from the first to the second,
    `d = n·(p₂ - p₁)` and `∂d/∂q = n·(J(p₂) - J(p₁))`.

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
        self._geometry_data = pin.GeometryData(self._geometry)
        self._moves = np.array([self._ancestors(pair) for pair in self._geometry.collisionPairs])  # (P, 2, n)
        self._results = _ResultReader(self)
        self.observe(obstacles)

    @property
    def size(self) -> int:
        """Number of pairs P."""
        return len(self.pairs)

    def distances(
        self, q: FloatArray, reach: FloatArray | float = np.inf, times: FloatArray | None = None
    ) -> Distances:
        """Return the signed distances along a trajectory, and gradients of those below `reach`.

        Args:
            q: configurations, (K, n).
            reach: the largest distance whose gradient is wanted, for all pairs or each, (P,) [m].
            times: of the configurations from now on, (K,) [s]; moving obstacles are where they will be then.
        """
        witnesses = np.empty((len(q), self.size, 9))
        jacobians = np.empty((len(q), 6, self._model.nv))
        for node, configuration in enumerate(q):
            self.compute(configuration, 0.0 if times is None else times[node])
            witnesses[node] = self._results.read()
            jacobians[node] = pin.computeJointJacobians(self._model, self._data)
        values = _signed(witnesses)
        near = np.argwhere(values < reach)
        return Distances(values, near, self._gradients(witnesses, jacobians, near))

    def values(self, q: FloatArray, times: FloatArray | None = None) -> FloatArray:
        """Return the signed distances at configurations (K, n) and times (K,), (K, P) [m]."""
        witnesses = np.empty((len(q), self.size, 9))
        for node, configuration in enumerate(q):
            self.compute(configuration, 0.0 if times is None else times[node])
            witnesses[node] = self._results.read()
        return _signed(witnesses)

    def observe(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now and how fast they move.

        Raises:
            HandrailError: they are not the obstacles that the model was built with.
        """
        names = tuple(obstacle.name for obstacle in obstacles)
        if names != tuple(self._obstacles):
            raise HandrailError(f"obstacles: expected {', '.join(self._obstacles)}, got {', '.join(names)}")
        self._moving = []
        for obstacle in obstacles:
            geometry = self._geometry.geometryObjects[self._obstacles[obstacle.name]]
            geometry.placement = pin.SE3(np.array(obstacle.rotation), np.array(obstacle.position))
            if obstacle.velocity.any():
                self._moving.append((geometry, obstacle))

    def _gradients(self, witnesses: FloatArray, jacobians: FloatArray, near: IntArray) -> FloatArray:
        node, pair = near[:, 0], near[:, 1]
        normal, first, second = np.split(witnesses[node, pair], 3, axis=1)  # (R, 3) each
        wrenches = np.empty((len(near), 2, 6))
        wrenches[:, :, :3] = normal[:, None, :]
        wrenches[:, 0, 3:] = _cross(first, normal)
        wrenches[:, 1, 3:] = _cross(second, normal)
        rows = (wrenches @ jacobians[node]) * self._moves[pair]
        return rows[:, 1] - rows[:, 0]

    def compute(self, q: FloatArray, time: float = 0.0) -> None:
        """Let coal compute every pair at q, with moving obstacles where they are after a time [s]."""
        for geometry, obstacle in self._moving:
            position = obstacle.position + time * obstacle.velocity
            geometry.placement = pin.SE3(np.array(obstacle.rotation), position)
        pin.computeDistances(self._model, self._data, self._geometry, self._geometry_data, q)

    @property
    def results(self) -> pin.StdVec_DistanceResult:
        """Coal's results of the last `compute`."""
        return self._geometry_data.distanceResults

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

    def _ancestors(self, pair: pin.CollisionPair) -> FloatArray:
        """Return which coordinates move the two shapes of a pair, (2, n)."""
        moves = np.zeros((2, self._model.nv))
        for row, index in enumerate((pair.first, pair.second)):
            joint = self._geometry.geometryObjects[index].parentJoint
            while joint > 0:
                moves[row, self._model.joints[joint].idx_v] = 1.0
                joint = self._model.parents[joint]
        return moves


class _ResultReader:
    """Reads normals and nearest points of all pairs at once.

    Coal's results lie in one C++ vector, each with normal and both nearest points side by side, and the
    binding hands out views of that memory: one strided view reads them all. Where a build lays them out
    otherwise, they are read one by one.
    """

    def __init__(self, collision: CollisionModel) -> None:
        self._collision = collision
        collision.compute(pin.neutral(collision._model))
        self._view = self._strided(collision.results)

    def read(self) -> FloatArray:
        """Return normals, first and second nearest points in the world, side by side, (P, 9)."""
        return self._one_by_one(self._collision.results) if self._view is None else self._view

    @classmethod
    def _strided(cls, results: pin.StdVec_DistanceResult) -> FloatArray | None:
        normals = [result.normal for result in results]
        addresses = np.array([normal.__array_interface__["data"][0] for normal in normals])
        strides = np.unique(np.diff(addresses))
        if normals[0].flags.owndata or strides.size != 1 or strides[0] < 72:
            return None
        view = np.lib.stride_tricks.as_strided(
            normals[0], (len(normals), 9), (int(strides[0]), 8), writeable=False
        )
        return view if np.array_equal(view, cls._one_by_one(results)) else None

    @staticmethod
    def _one_by_one(results: pin.StdVec_DistanceResult) -> FloatArray:
        return np.array([[*r.normal, *r.getNearestPoint1(), *r.getNearestPoint2()] for r in results])


def _signed(witnesses: FloatArray) -> FloatArray:
    """Return n·(p₂ - p₁) of the rows (n, p₁, p₂), (…, 9) → (…)."""
    return np.einsum("...i,...i->...", witnesses[..., 0:3], witnesses[..., 6:9] - witnesses[..., 3:6])


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return row-wise cross products, several times faster than numpy's for few rows."""
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]


def _coal_shape(shape: Shape) -> coal.ShapeBase:
    make = {"box": coal.Box, "capsule": coal.Capsule, "sphere": coal.Sphere, "cylinder": coal.Cylinder}
    return make[shape.kind](*(float(length) for length in shape.size))

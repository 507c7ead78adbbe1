"""Which of a robot's shapes can meet each other: by sampling all that its joints allow."""

import itertools
from collections.abc import Sequence

import coal
import numpy as np
import pinocchio as pin
from scipy.optimize import minimize

from handrail.controllers.arrays import BoolArray, FloatArray, IntArray
from handrail.controllers.collision.shape_pairs import coal_shape
from handrail.controllers.modelling.clouds import LinkCloud
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.parts import PlacedShape

_INSIDE = 0.005  # of a shape that the middle of a link's triangle may stick out of, and still be its own [m]
_NESTED = 0.5  # share of configurations
_STRIDE = 10  # from one configuration to the next that is looked at
_TRIES = 300  # distances that are measured on the way to a meeting


class Meetings:
    """Statistics of all pairs of shapes on bodies that are no neighbours, and of the meshes in them.

    In K configurations: random ones, then for each pair that did not meet there one that brings it nearer.

    Args:
        model: of the robot.
        clouds: of its links.
        count: of the random configurations.

    Attributes:
        beside: share of the random configurations in which the meshes of neighbours touch, by the names of
            their shapes; where that is less than half.
        pairs: names of the shapes, (P,) of (str, str).
        joints: numbers of the joints that carry them, (P,) of (int, int).
        q: configurations, (K, n).
        distances: of the shapes [m], (K, P).
        overlap: share of the random configurations in which shapes overlap, (P,).
        nested: joints whose bodies are built into each other: their meshes touch in most configurations.
    """

    def __init__(self, model: RobotModel, clouds: Sequence[LinkCloud], count: int) -> None:
        self._model, self._data = model.pinocchio, model.pinocchio.createData()
        self._shapes, self._meshes = pin.GeometryModel(), pin.GeometryModel()
        for placed in model.description.collision:
            joint, at = model.mount(placed)
            shape = coal_shape(placed.shape)
            self._shapes.addGeometryObject(pin.GeometryObject(placed.name, joint, at, shape))
            own = [cloud.triangles for cloud in clouds if cloud.joint == joint]
            triangles = np.vstack([*own, np.empty((0, 3, 3))])
            triangles = triangles[outside(model, placed, triangles.mean(axis=1)) < _INSIDE]
            solid = (pin.SE3.Identity(), _mesh(triangles)) if len(triangles) else (at, shape)
            self._meshes.addGeometryObject(pin.GeometryObject(placed.name, joint, *solid))
        names = [placed.name for placed in model.description.collision]
        joints = [each.parentJoint for each in self._shapes.geometryObjects]
        self.pairs, self.joints, neighbours = [], [], []
        for i, j in itertools.combinations(range(len(names)), 2):
            first, last = sorted((joints[i], joints[j]))
            if first != last and self._model.parents[last] == first:
                neighbours.append((i, j))
            elif first != last:
                for geometry in (self._shapes, self._meshes):
                    geometry.addCollisionPair(pin.CollisionPair(i, j))
                self.pairs.append((names[i], names[j]))
                self.joints.append((first, last))
        for pair in neighbours:  # after the others, which have the same numbers in both
            self._meshes.addCollisionPair(pin.CollisionPair(*pair))
        self._measured, self._touched = self._shapes.createData(), self._meshes.createData()
        self._shares: dict[int, float] = {}
        q = configurations(model, count, np.random.default_rng(0))
        drawn = self._distances(q)
        self.overlap = (drawn < 0.0).mean(axis=0)
        apart = np.flatnonzero(drawn.min(axis=0, initial=np.inf) > 0.0)
        nearer = [self._approached(model, int(index), q[np.argmin(drawn[:, index])]) for index in apart]
        self.q = np.vstack([q, *nearer])
        self.distances = np.vstack([drawn, self._distances(self.q[count:])])
        often = np.flatnonzero(self.overlap > _NESTED)
        rows, first = np.arange(0, count, _STRIDE), len(self.pairs)
        shares = [self.touching(first + k, rows).mean() for k in range(len(neighbours))]
        self.beside = {
            (names[i], names[j]): share
            for (i, j), share in zip(neighbours, shares, strict=True)
            if 0.0 < share < _NESTED
        }
        self.nested = {self.joints[index] for index in often if self.share(index) > _NESTED}

    def touching(self, index: int, rows: IntArray) -> BoolArray:
        """Return whether the very meshes in a pair of shapes touch, in some of the configurations."""
        found = np.zeros(len(rows), dtype=bool)
        for number, row in enumerate(rows):
            pin.updateGeometryPlacements(self._model, self._data, self._meshes, self._touched, self.q[row])
            found[number] = pin.computeCollision(self._meshes, self._touched, int(index))
        return found

    def share(self, index: int) -> float:
        """Return in which share of the configurations the meshes in a pair of shapes touch, nearly."""
        if index not in self._shares:
            near = np.flatnonzero(self.distances[:, index] < 0.0)
            some = self.touching(index, near[::_STRIDE]).sum() * _STRIDE
            self._shares[index] = (some or self.touching(index, near).sum()) / len(self.q)
        return self._shares[index]

    def _distances(self, q: FloatArray) -> FloatArray:
        """Return those of all pairs, (K, P)."""
        found = np.empty((len(q), len(self.pairs)))
        for row, each in zip(found, q, strict=True):
            pin.computeDistances(self._model, self._data, self._shapes, self._measured, each)
            row[:] = [result.min_distance for result in self._measured.distanceResults]
        return found

    def _approached(self, model: RobotModel, index: int, q: FloatArray) -> FloatArray:
        """Return a configuration nearer to a meeting than q, (n,), the base where it is."""

        def distance(q: FloatArray) -> float:
            pin.updateGeometryPlacements(self._model, self._data, self._shapes, self._measured, q)
            return pin.computeDistance(self._shapes, self._measured, index).min_distance

        limits, moves = model.description.limits, np.arange(model.size) >= len(model.description.base.joints)
        ends = np.where(moves, [limits.position_lower, limits.position_upper], q)
        return minimize(distance, q, bounds=ends.T, options={"maxfun": _TRIES}).x


def configurations(model: RobotModel, count: int, rng: np.random.Generator) -> FloatArray:
    """Return random configurations inside the limits, the base at zero, (count, n)."""
    limits, base = model.description.limits, len(model.description.base.joints)
    q = rng.uniform(limits.position_lower, limits.position_upper, (count, model.size))
    q[:, :base] = 0.0
    return q


def outside(model: RobotModel, placed: PlacedShape, points: FloatArray) -> FloatArray:
    """Return how far points of the body stick out of a shape, (k,) [m]; 0 of those inside."""
    _, at = model.mount(placed)
    local, size = np.abs((points - at.translation) @ at.rotation), placed.shape.size
    if placed.shape.kind == "box":
        return np.linalg.norm(np.maximum(local - size / 2, 0.0), axis=1)
    half = size[1] / 2 if len(size) > 1 else 0.0
    above, aside = np.maximum(local[:, 2] - half, 0.0), np.hypot(local[:, 0], local[:, 1])
    if placed.shape.kind == "cylinder":
        return np.hypot(np.maximum(aside - size[0], 0.0), above)
    return np.maximum(np.hypot(aside, above) - size[0], 0.0)


def _mesh(triangles: FloatArray) -> coal.CollisionGeometry:
    mesh = coal.BVHModelOBBRSS()
    mesh.beginModel(len(triangles), 3 * len(triangles))
    for triangle in triangles:
        mesh.addTriangle(*triangle)
    mesh.endModel()
    return mesh

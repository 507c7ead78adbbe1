"""Which of a robot's shapes can meet each other: by sampling all that its joints allow."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import coal
import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import FloatArray
from handrail.controllers.modelling.clouds import LinkCloud
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.parts import PlacedShape
from handrail.controllers.robot.shape import Shape

_INSIDE = 0.005  # of a shape that a link's corner may stick out of, and still be its own [m]
_STEPS = 150  # towards a meeting
_ALWAYS = 0.5  # share of configurations in which shapes overlap that do so always


@dataclass(frozen=True)
class Meetings:
    """What became of all pairs of shapes on bodies that are no neighbours.

    In K configurations: random ones, then for each pair that did not meet there one that brings it nearer.
    """

    q: FloatArray  # (K, n)
    drawn: int  # how many are random

    pairs: list[tuple[str, str]]  # (P,)
    distances: FloatArray  # of their shapes [m], (K, P)
    links: FloatArray  # of the links in them, where the shapes are near; infinite elsewhere, (K, P)

    @property
    def nearest(self) -> FloatArray:
        """How near the links come [m], (P,)."""
        return self.links.min(axis=0)

    @property
    def always(self) -> list[tuple[str, str]]:
        """Pairs that overlap in most configurations: their shapes are too loose to say anything."""
        share = (self.distances[: self.drawn] < 0.0).mean(axis=0)
        return [pair for pair, each in zip(self.pairs, share, strict=True) if each > _ALWAYS]


def configurations(model: RobotModel, count: int, rng: np.random.Generator) -> FloatArray:
    """Return random configurations inside the limits, the base at zero, (count, n)."""
    limits, base = model.description.limits, len(model.description.base.joints)
    q = rng.uniform(limits.position_lower, limits.position_upper, (count, model.size))
    q[:, :base] = 0.0
    return q


def meetings(model: RobotModel, clouds: list[LinkCloud], q: FloatArray, near: float) -> Meetings:
    """Measure all pairs of shapes, and what they enclose where they come nearer than `near` [m].

    Args:
        model: of the robot.
        clouds: of its links.
        q: random configurations, (K, n).
        near: see above.
    """
    shapes, pinocchio = model.description.collision, model.pinocchio
    carriers = [model.mount(placed)[0] for placed in shapes]
    loose, tight = pin.GeometryModel(), pin.GeometryModel()
    for placed in shapes:
        joint, at = model.mount(placed)
        loose.addGeometryObject(pin.GeometryObject(placed.name, joint, at, _coal(placed.shape)))
        points = [cloud.points for cloud in clouds if cloud.joint == joint and encloses(model, placed, cloud)]
        tight.addGeometryObject(
            pin.GeometryObject(
                placed.name,
                joint,
                *((pin.SE3.Identity(), _convex(points)) if points else (at, _coal(placed.shape))),
            )
        )
    numbers = [
        (i, j)
        for i, j in itertools.combinations(range(len(shapes)), 2)
        if carriers[i] != carriers[j]
        and pinocchio.parents[max(carriers[i], carriers[j])] != min(carriers[i], carriers[j])
    ]
    for pair in numbers:
        loose.addCollisionPair(pin.CollisionPair(*pair))
        tight.addCollisionPair(pin.CollisionPair(*pair))
    data, measured, exact = pinocchio.createData(), loose.createData(), tight.createData()

    def distances(q: FloatArray) -> FloatArray:
        """Return those of all pairs, (K, P)."""
        found = np.empty((len(q), len(numbers)))
        for row, each in zip(found, q, strict=True):
            pin.computeDistances(pinocchio, data, loose, measured, each)
            row[:] = [result.min_distance for result in measured.distanceResults]
        return found

    def distance(index: int, q: FloatArray) -> float:
        pin.updateGeometryPlacements(pinocchio, data, loose, measured, q)
        return pin.computeDistance(loose, measured, index).min_distance

    drawn = distances(q)
    apart = np.flatnonzero(drawn.min(axis=0, initial=np.inf) > 0.0)
    nearer = [_approached(model, partial(distance, int(k)), q[np.argmin(drawn[:, k])]) for k in apart]
    every = np.vstack([q, *nearer])
    values = np.vstack([drawn, distances(every[len(q) :])])
    links = np.full(values.shape, np.inf)
    for k, each in enumerate(every):
        pin.updateGeometryPlacements(pinocchio, data, tight, exact, each)
        for index in np.flatnonzero(values[k] < near):
            links[k, index] = pin.computeDistance(tight, exact, int(index)).min_distance
    names = [(shapes[i].name, shapes[j].name) for i, j in numbers]
    return Meetings(every, len(q), names, values, links)


def _approached(model: RobotModel, distance: Callable[[FloatArray], float], q: FloatArray) -> FloatArray:
    """Return a configuration nearer to a meeting than q, (n,): by random steps that grow smaller."""
    limits, rng = model.description.limits, np.random.default_rng(0)
    spread = (np.arange(model.size) >= len(model.description.base.joints)) * (
        limits.position_upper - limits.position_lower
    )
    least = distance(q)
    for size in np.geomspace(0.2, 0.01, _STEPS):
        step = size * rng.normal(size=model.size) * spread
        there = np.clip(q + step, limits.position_lower, limits.position_upper)
        if (value := distance(there)) < least:
            q, least = there, value
        if least < 0.0:
            break
    return q


def count_meetings(model: RobotModel, clouds: list[LinkCloud], pair: tuple[str, str], q: FloatArray) -> int:
    """Return in how many configurations, (K, n), the very meshes in two shapes meet."""
    surfaces = pin.GeometryModel()
    for placed in model.description.collision:
        if placed.name in pair:
            joint, at = model.mount(placed)
            own = [cloud.triangles for cloud in clouds if cloud.joint == joint]
            triangles = np.vstack([*own, np.empty((0, 3, 3))])
            out = outside(model, placed, triangles.reshape(-1, 3)).reshape(-1, 3)
            triangles = triangles[(out < _INSIDE).any(axis=1)]
            solid = (pin.SE3.Identity(), _mesh(triangles)) if len(triangles) else (at, _coal(placed.shape))
            surfaces.addGeometryObject(pin.GeometryObject(placed.name, joint, *solid))
    surfaces.addCollisionPair(pin.CollisionPair(0, 1))
    data, result = model.pinocchio.createData(), surfaces.createData()
    return sum(pin.computeCollisions(model.pinocchio, data, surfaces, result, each, True) for each in q)


def encloses(model: RobotModel, placed: PlacedShape, cloud: LinkCloud) -> bool:
    """Whether a shape is around a link of the same body."""
    return bool(outside(model, placed, cloud.points).max() < _INSIDE)


def outside(model: RobotModel, placed: PlacedShape, points: FloatArray) -> FloatArray:
    """Return how far points of the body stick out of a shape, (k,) [m]; 0 of those inside."""
    _, at = model.mount(placed)
    local, size = np.abs((points - at.translation) @ at.rotation), placed.shape.size
    if placed.shape.kind == "box":
        return np.linalg.norm(np.maximum(local - size / 2, 0.0), axis=1)
    half = size[1] / 2 if len(size) > 1 else 0.0
    if placed.shape.kind == "cylinder":
        away = np.column_stack([np.hypot(local[:, 0], local[:, 1]) - size[0], local[:, 2] - half])
        return np.linalg.norm(np.maximum(away, 0.0), axis=1)
    local[:, 2] = np.maximum(local[:, 2] - half, 0.0)
    return np.maximum(np.linalg.norm(local, axis=1) - size[0], 0.0)


def _coal(shape: Shape) -> coal.CollisionGeometry:
    return {"box": coal.Box, "capsule": coal.Capsule, "sphere": coal.Sphere, "cylinder": coal.Cylinder}[
        shape.kind
    ](*map(float, shape.size))


def _convex(parts: list[FloatArray]) -> coal.CollisionGeometry:
    points = coal.StdVec_Vec3s()
    points.extend(list(np.vstack(parts)))
    return coal.Convex.convexHull(points, True, "Qt")


def _mesh(triangles: FloatArray) -> coal.CollisionGeometry:
    mesh = coal.BVHModelOBBRSS()
    mesh.beginModel(len(triangles), 3 * len(triangles))
    for triangle in triangles:
        mesh.addTriangle(*triangle)
    mesh.endModel()
    return mesh

"""What a robot's links fill: the points of their collision meshes, else of their visual ones."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.errors import HandrailError, message_of
from handrail.controllers.robot.model import RobotModel, read_urdf
from handrail.controllers.robot.parts import Arm, Placement
from handrail.controllers.robot.urdf import mesh_files, urdf_text

_SIDES = 24  # of the prism around a cylinder
_LARGEST = 1e3  # of a robot [m]
_MARK = 0.01  # size of what stands in for a collision mesh that nobody made [m]


@dataclass(frozen=True)
class LinkCloud:
    """The triangles around a link, (m, 3, 3) [m], on the joint that carries it."""

    link: str
    joint: int  # of the robot's model; 0 stands still on the base
    triangles: FloatArray

    @cached_property
    def points(self) -> FloatArray:
        """The corners of its convex hull, (k, 3)."""
        return hull(self.triangles.reshape(-1, 3))


def link_clouds(model: RobotModel) -> list[LinkCloud]:
    """Return what each link of a robot fills.

    A body without any collision geometry, and a link whose is a mere mark, are as they look.
    """
    return [cloud for arm in model.description.arms for cloud in _of_arm(model, arm)]


def hull(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of points, (k, 3); of flat ones too."""
    points = np.unique(points, axis=0)
    return points[ConvexHull(points, qhull_options="QJ Pp").vertices]


type Geometry = list[tuple[str, int, FloatArray]]


def urdf_geometry(arm: Arm) -> tuple[Geometry, Geometry]:
    """Return collision and visual geometry: link, joint of the URDF, triangles on that, (m, 3, 3)."""
    return _read(arm.urdf, arm.mesh_root, arm.prefix)


def triangles_of(shape: coal.CollisionGeometry) -> tuple[FloatArray, IntArray]:
    """Return the corners of a mesh, (k, 3), and the triangles of their numbers, (m, 3)."""
    found = (shape.tri_indices(number) for number in range(shape.num_tris))
    faces = [[triangle[side] for side in range(3)] for triangle in found]
    return np.array(shape.vertices()), np.array(faces, dtype=int).reshape(-1, 3)


@lru_cache(maxsize=2)
def _read(urdf: Path, mesh_root: Path, prefix: str) -> tuple[Geometry, Geometry]:
    arm = Arm(urdf, mesh_root, prefix, (), "", Placement(np.zeros(3), np.eye(3)))
    robot, text = read_urdf(arm), urdf_text(arm)
    list(mesh_files(urdf, mesh_root))  # refuses those outside
    try:
        both = [
            pin.buildGeomFromUrdfString(robot, text, kind, package_dirs=[str(mesh_root)])
            for kind in (pin.COLLISION, pin.VISUAL)
        ]
    except (ValueError, RuntimeError) as error:
        raise HandrailError(f"URDF {urdf}: {message_of(error)}") from error
    collision, visual = (
        [
            (
                robot.frames[item.parentFrame].name,
                item.parentJoint,
                _placed(item.placement, _triangles(item.geometry)),
            )
            for item in geometry.geometryObjects
        ]
        for geometry in both
    )
    return collision, visual


def _of_arm(model: RobotModel, arm: Arm) -> Iterator[LinkCloud]:
    robot = read_urdf(arm)
    collision, visual = urdf_geometry(arm)
    solid = {_frame(model, link).parentJoint for link in _by_link(collision)}
    seen = _by_link(visual)
    links = {link: each for link, each in seen.items() if _frame(model, link).parentJoint not in solid}
    for link, each in _by_link(collision).items():
        links[link] = seen[link] if np.ptp(each, axis=(0, 1)).max() < _MARK and link in seen else each
    for link, triangles in links.items():
        if not np.abs(triangles).max() < _LARGEST:
            raise HandrailError(f"URDF {arm.urdf}: link {link}: expected a mesh of sane size [m]")
        on_link = robot.frames[robot.getFrameId(link, pin.FrameType.BODY)].placement.inverse()
        frame = _frame(model, link)
        yield LinkCloud(link, frame.parentJoint, _placed(frame.placement * on_link, triangles))


def _by_link(geometry: Geometry) -> dict[str, FloatArray]:
    links = dict.fromkeys(link for link, _, _ in geometry)
    return {name: np.vstack([each for link, _, each in geometry if link == name]) for name in links}


def _frame(model: RobotModel, link: str) -> pin.Frame:
    return model.pinocchio.frames[model.pinocchio.getFrameId(link, pin.FrameType.BODY)]


def _placed(placement: pin.SE3, points: FloatArray) -> FloatArray:
    return points @ placement.rotation.T + placement.translation


def _triangles(shape: coal.CollisionGeometry) -> FloatArray:
    """Return the triangles of a mesh, or around a shape, (m, 3, 3)."""
    if isinstance(shape, coal.BVHModelBase):
        points, faces = triangles_of(shape)
        return points[faces]
    points = _points(shape)
    return points[ConvexHull(points, qhull_options="QJ Pp").simplices]


def _points(shape: coal.CollisionGeometry) -> FloatArray:
    """Return points around a shape, whose hull encloses it, (k, 3)."""
    if isinstance(shape, coal.Box):
        return np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T * shape.halfSide
    angle = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]) / np.cos(np.pi / _SIDES)
    if isinstance(shape, coal.Cylinder):
        rings = [ring * shape.radius + [0.0, 0.0, z] for z in (-shape.halfLength, shape.halfLength)]
        return np.vstack(rings)
    half = getattr(shape, "halfLength", 0.0)  # of a capsule; a sphere has none
    tilts = np.linspace(-np.pi / 2, np.pi / 2, _SIDES // 2 + 1)
    return np.vstack(
        [
            shape.radius * (np.cos(tilt) * ring + [0.0, 0.0, np.sin(tilt) / np.cos(np.pi / _SIDES)])
            + [0.0, 0.0, half * np.sign(tilt)]
            for tilt in tilts
        ]
    )

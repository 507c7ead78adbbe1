"""The space that a robot's links fill: the triangles of their collision meshes, else of their visual ones."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.errors import HandrailError, restated
from handrail.controllers.robot.model import RobotModel, read_urdf
from handrail.controllers.robot.parts import Arm, Placement
from handrail.controllers.robot.urdf import mesh_files, urdf_text

_SIDES = 24  # of the prism around a cylinder
_LARGEST = 10.0  # of a robot [m]
_MARK = 0.01  # size of what stands in for a collision mesh that nobody made [m]
_LONG = 0.1  # side of a triangle [m]


@dataclass(frozen=True)
class LinkCloud:
    """The triangles around a link, (m, 3, 3) [m], on a joint."""

    link: str
    joint: int  # of the robot's model, 0 stands still on the base; of the URDF where that is read alone
    triangles: FloatArray

    def moved(self, joint: int, placement: pin.SE3) -> "LinkCloud":
        """Return it on a joint, where its joint is placed so."""
        points = self.triangles @ placement.rotation.T + placement.translation
        return LinkCloud(self.link, joint, points)


def link_clouds(model: RobotModel) -> list[LinkCloud]:
    """Return what each link of a robot fills, in triangles with sides of at most 10 cm.

    A body without any collision geometry, and a link whose is a mere mark, are as they look.
    """
    return [cloud for arm in model.description.arms for cloud in _of_arm(model, arm)]


def body_frame(model: pin.Model, link: str) -> pin.Frame:
    """Return a link's frame."""
    return model.frames[model.getFrameId(link, pin.FrameType.BODY)]


def hull(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of points, (k, 3); of flat ones too."""
    return points if len(points) < 4 else points[ConvexHull(points, qhull_options="QJ Pp").vertices]


def geometry_models(arm: Arm) -> tuple[pin.GeometryModel, pin.GeometryModel]:
    """Return the collision and the visual geometry that a URDF names."""
    robot, text = read_urdf(arm), urdf_text(arm)
    list(mesh_files(arm.urdf, arm.mesh_root))  # refuses those outside
    with restated(f"URDF {arm.urdf}", (ValueError, RuntimeError)):
        read = partial(pin.buildGeomFromUrdfString, robot, text, package_dirs=[str(arm.mesh_root)])
        return read(pin.COLLISION), read(pin.VISUAL)


type Links = dict[str, LinkCloud]  # by their names


@lru_cache(maxsize=2)
def urdf_clouds(urdf: Path, mesh_root: Path, prefix: str) -> tuple[Links, Links]:
    """Return what a URDF's links fill and how they look, by their names, on its joints; see `Arm`."""
    arm = Arm(urdf, mesh_root, prefix, (), "", Placement(np.zeros(3), np.eye(3)))
    robot, found = read_urdf(arm), ({}, {})
    for geometry, links in zip(geometry_models(arm), found, strict=True):
        for item in geometry.geometryObjects:
            link = robot.frames[item.parentFrame].name
            triangles = _triangles(item.geometry)
            if not np.abs(triangles).max(initial=0.0) < _LARGEST:
                raise HandrailError(f"URDF {urdf}: link {link}: expected a mesh of sane size [m]")
            more = LinkCloud(link, item.parentJoint, _fine(triangles)).moved(item.parentJoint, item.placement)
            before = [links[link].triangles] if link in links else []
            links[link] = replace(more, triangles=np.vstack([*before, more.triangles]))
    return found


def triangles_of(shape: coal.CollisionGeometry) -> tuple[FloatArray, IntArray]:
    """Return the corners of a mesh, (k, 3), and the triangles of their numbers, (m, 3)."""
    found = (shape.tri_indices(number) for number in range(shape.num_tris))
    faces = [[triangle[side] for side in range(3)] for triangle in found]
    return np.array(shape.vertices()), np.array(faces, dtype=int).reshape(-1, 3)


def _of_arm(model: RobotModel, arm: Arm) -> Iterator[LinkCloud]:
    robot, (collision, visual) = read_urdf(arm), urdf_clouds(arm.urdf, arm.mesh_root, arm.prefix)
    frame = {link: body_frame(model.pinocchio, link) for link in {**collision, **visual}}
    solid = {frame[link].parentJoint for link in collision}
    marks = {link for link in collision if np.ptp(collision[link].triangles, axis=(0, 1)).max() < _MARK}
    seen = {link for link in visual if frame[link].parentJoint not in solid or link in marks}
    for link, cloud in (collision | {link: visual[link] for link in seen}).items():
        on_link = body_frame(robot, link).placement.inverse()
        yield cloud.moved(frame[link].parentJoint, frame[link].placement * on_link)


def _triangles(shape: coal.CollisionGeometry) -> FloatArray:
    """Return the triangles of a mesh, or around a shape, (m, 3, 3)."""
    if isinstance(shape, coal.BVHModelBase):
        points, faces = triangles_of(shape)
        return points[faces]
    points = _points(shape)
    return points[ConvexHull(points, qhull_options="QJ Pp").simplices]


def _fine(triangles: FloatArray) -> FloatArray:
    """Return triangles, large ones in four."""
    sides = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2)
    large = (sides > _LONG).any(axis=1)
    if not large.any():
        return triangles
    a, b, c = triangles[large].transpose(1, 0, 2)
    d, e, f = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = [np.stack(corners, axis=1) for corners in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))]
    return np.vstack([triangles[~large], _fine(np.vstack(parts))])


def _points(shape: coal.CollisionGeometry) -> FloatArray:
    """Return points around a shape, whose hull encloses it, (k, 3)."""
    if isinstance(shape, coal.Box):
        return np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T * shape.halfSide
    angles = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
    tilts = np.linspace(0.0, np.pi / 2, 1 if isinstance(shape, coal.Cylinder) else _SIDES // 4 + 1)
    angle, tilt, side = (each.ravel() for each in np.meshgrid(angles, tilts, (-1.0, 1.0)))
    ball = np.column_stack([np.cos(tilt) * np.cos(angle), np.cos(tilt) * np.sin(angle), side * np.sin(tilt)])
    half = getattr(shape, "halfLength", 0.0)  # a sphere has none
    return ball * shape.radius / np.cos(np.pi / _SIDES) ** 2 + np.outer(side * half, [0.0, 0.0, 1.0])

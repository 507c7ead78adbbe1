"""The arm's meshes as a camera sees them: split into their pieces, coloured."""

from collections.abc import Iterator
from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel

_TUBE, _JOINT, _CAP = (0.80, 0.81, 0.83, 1.0), (0.42, 0.44, 0.47, 1.0), (0.32, 0.56, 0.76, 1.0)


@dataclass(frozen=True)
class Piece:
    """A connected piece of a mesh: vertices, (k, 3) [m], faces of their indices, (f, 3), and its colour."""

    vertices: FloatArray
    faces: NDArray[np.int64]
    rgba: tuple[float, float, float, float]


@dataclass(frozen=True)
class PlacedMesh:
    """A link's mesh: its pieces, and its placement in the frame of a pinocchio joint."""

    name: str
    joint: int
    placement: pin.SE3
    pieces: tuple[Piece, ...]


def placed_meshes(model: RobotModel) -> Iterator[PlacedMesh]:
    """Yield the collision meshes that the robot's URDF names."""
    description = model.description
    arm = pin.buildModelFromUrdf(str(description.urdf))
    geometry = pin.buildGeomFromUrdf(
        arm, str(description.urdf), pin.COLLISION, package_dirs=[str(description.mesh_root)]
    )
    for item in geometry.geometryObjects:
        if not isinstance(item.geometry, coal.BVHModelBase):
            continue  # a primitive, such as the marker box on the UR's ee_link
        link = arm.frames[item.parentFrame]
        frame = model.pinocchio.frames[model.pinocchio.getFrameId(link.name, pin.FrameType.BODY)]
        placement = frame.placement * (link.placement.inverse() * item.placement)
        yield PlacedMesh(item.name, frame.parentJoint, placement, _pieces(item.geometry))


def _pieces(mesh: coal.BVHModelBase) -> tuple[Piece, ...]:
    """Return the connected pieces, without those that are flat."""
    triangles = map(mesh.tri_indices, range(mesh.num_tris))
    corners = [triangle[corner] for triangle in triangles for corner in range(3)]
    every = mesh.vertices()[corners].round(7)  # a vertex of several triangles may be there as often
    vertices, faces = np.unique(every, axis=0, return_inverse=True)
    faces = faces.reshape(-1, 3)
    edges = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(vertices),) * 2)
    count, labels = connected_components(graph, directed=False)
    parts = [_part(vertices, faces, labels == label) for label in range(count)]
    solid = [part for part in parts if np.ptp(part[0], axis=0).min() > 1e-3]
    return tuple(Piece(*part, _colour(part[0]) if len(solid) > 1 else _JOINT) for part in solid)


def _part(
    vertices: FloatArray, faces: NDArray[np.int64], keep: NDArray[np.bool_]
) -> tuple[FloatArray, NDArray[np.int64]]:
    renumber = np.cumsum(keep) - 1
    return vertices[keep], renumber[faces[keep[faces[:, 0]]]]


def _colour(vertices: FloatArray) -> tuple[float, float, float, float]:
    """Return a slender piece's colour, a tube's, a flat one's, a cap's, or a joint housing's."""
    low, middle, high = np.sort(np.ptp(vertices, axis=0))
    return _TUBE if high > 2.0 * middle else _CAP if low < 0.75 * middle else _JOINT

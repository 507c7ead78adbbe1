"""The arm's meshes as a camera sees them: STL files, split into their pieces, coloured."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import RobotModel

_TUBE, _JOINT, _CAP = (0.80, 0.81, 0.83, 1.0), (0.42, 0.44, 0.47, 1.0), (0.32, 0.56, 0.76, 1.0)
_TRIANGLE = np.dtype([("normal", "<3f4"), ("vertices", "<9f4"), ("attribute", "<u2")])


@dataclass(frozen=True)
class Piece:
    """A connected piece of a mesh.

    Attributes:
        vertices: in the mesh's frame [m], (k, 3).
        faces: indices of vertices, (f, 3).
        rgba: its colour.
    """

    vertices: FloatArray
    faces: NDArray[np.int64]
    rgba: tuple[float, float, float, float]


@dataclass(frozen=True)
class PlacedMesh:
    """A link's mesh: its file, scale and placement in the frame of a pinocchio joint."""

    name: str
    path: Path
    scale: FloatArray
    joint: int
    placement: pin.SE3


def placed_meshes(model: RobotModel) -> Iterator[PlacedMesh]:
    """Yield the collision meshes that the robot's URDF names."""
    description = model.description
    arm = pin.buildModelFromUrdf(str(description.urdf))
    geometry = pin.buildGeomFromUrdf(
        arm, str(description.urdf), pin.COLLISION, package_dirs=[str(description.mesh_root)]
    )
    for item in geometry.geometryObjects:
        if not Path(item.meshPath).is_file():
            continue  # a primitive, such as the marker box on the UR's ee_link
        link = arm.frames[item.parentFrame]
        frame = model.pinocchio.frames[model.pinocchio.getFrameId(link.name, pin.FrameType.BODY)]
        placement = frame.placement * (link.placement.inverse() * item.placement)
        yield PlacedMesh(item.name, Path(item.meshPath), item.meshScale, frame.parentJoint, placement)


@lru_cache(maxsize=64)
def pieces(path: Path) -> tuple[Piece, ...]:
    """Return the connected pieces of a binary STL file.

    Raises:
        HandrailError: it is not a binary STL file.
    """
    vertices, faces = _read_stl(path)
    edges = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(vertices),) * 2)
    count, labels = connected_components(graph, directed=False)
    parts = [_part(vertices, faces, labels == label) for label in range(count)]
    solid = [part for part in parts if np.ptp(part[0], axis=0).min() > 1e-3]
    return tuple(Piece(*part, colour) for part, colour in zip(solid, _colours(solid), strict=True))


def _read_stl(path: Path) -> tuple[FloatArray, NDArray[np.int64]]:
    data = path.read_bytes()
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else -1
    if len(data) < 84 + count * _TRIANGLE.itemsize or count < 0:
        raise HandrailError(f"mesh {path}: expected a binary STL file")
    corners = np.frombuffer(data, _TRIANGLE, count, 84)["vertices"].reshape(-1, 3).astype(float)
    vertices, index = np.unique(corners.round(7), axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 3)


def _part(
    vertices: FloatArray, faces: NDArray[np.int64], keep: NDArray[np.bool_]
) -> tuple[FloatArray, NDArray[np.int64]]:
    renumber = np.cumsum(keep) - 1
    return vertices[keep], renumber[faces[keep[faces[:, 0]]]]


def _colours(
    parts: list[tuple[FloatArray, NDArray[np.int64]]],
) -> list[tuple[float, float, float, float]]:
    """Colour the flattest pieces as caps, the most slender as a tube, the others as joint housings."""
    extents = [np.sort(np.ptp(vertices, axis=0)) for vertices, _ in parts]
    if len(parts) == 1:
        return [_JOINT]
    colours = []
    for low, middle, high in extents:
        flat, slender = low < 0.75 * middle, high > 2.0 * middle
        colours.append(_TUBE if slender else _CAP if flat else _JOINT)
    return colours

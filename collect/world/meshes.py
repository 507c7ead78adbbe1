"""The arm's meshes as a camera sees them, coloured as the URDF says, or by their pieces' form."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.modelling.clouds import body_frame, geometry_models, triangles_of
from handrail.controllers.regular_file import open_regular
from handrail.controllers.robot.model import RobotModel, read_urdf
from handrail.controllers.robot.parts import Arm
from handrail.controllers.robot.urdf import mesh_files

_TUBE, _JOINT, _CAP = (0.80, 0.81, 0.83, 1.0), (0.42, 0.44, 0.47, 1.0), (0.32, 0.56, 0.76, 1.0)
_GRID, _FINE = 2e-3, 10_000  # a mesh of more triangles is drawn with its vertices on a grid [m]
_LARGEST = 1e6  # of a coordinate, before it is scaled
_TRIANGLE = np.dtype([("normal", "<3f4"), ("vertices", "<9f4"), ("attribute", "<u2")])


@dataclass(frozen=True)
class MeshPiece:
    """A connected piece of a mesh: vertices, (k, 3) [m], faces of their indices, (f, 3), and its colour."""

    vertices: FloatArray
    faces: IntArray
    rgba: tuple[float, ...]


@dataclass(frozen=True)
class PlacedMesh:
    """A link's mesh: its pieces, and its placement in the frame of a pinocchio joint."""

    name: str
    link: str
    joint: int
    placement: pin.SE3
    pieces: tuple[MeshPiece, ...]


def placed_meshes(model: RobotModel) -> Iterator[PlacedMesh]:
    """Yield the collision meshes that the URDF names, in the colour of a visual one of the same file.

    A body that has none is drawn by its visual ones.
    """
    for arm in model.description.arms:
        yield from _of_arm(model, arm)


def _of_arm(model: RobotModel, described: Arm) -> Iterator[PlacedMesh]:
    for path in mesh_files(described.urdf, described.mesh_root):
        if path.suffix.lower() == ".stl":
            _corners(path)
    arm, (geometry, seen) = read_urdf(described), geometry_models(described)
    colours = {item.meshPath: tuple(map(float, item.meshColor)) for item in seen.geometryObjects}
    solid, shown = (
        [
            (item, body_frame(model.pinocchio, arm.frames[item.parentFrame].name))
            for item in each.geometryObjects
            if Path(item.meshPath).is_file()
        ]
        for each in (geometry, seen)
    )  # without primitives, such as the marker box on the UR's ee_link
    bodies = {frame.parentJoint for _, frame in solid}
    for item, frame in solid + [each for each in shown if each[1].parentJoint not in bodies]:
        link, path = arm.frames[item.parentFrame], Path(item.meshPath)
        placement = frame.placement * (link.placement.inverse() * item.placement)
        rgba = colours.get(item.meshPath)
        if path.suffix.lower() != ".stl":  # coal has scaled it
            pieces = (MeshPiece(*_without_details(*triangles_of(item.geometry)), rgba or _JOINT),)
            yield PlacedMesh(item.name, link.name, frame.parentJoint, placement, pieces)
            continue
        vertices, faces = _read_stl(path)
        if rgba is None:
            pieces = tuple(_pieces(vertices, faces, item.meshScale))
        else:
            pieces = (MeshPiece(*_without_details(vertices * item.meshScale, faces), rgba),)
        yield PlacedMesh(item.name, link.name, frame.parentJoint, placement, pieces)


def _without_details(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    """Return vertices and faces of a mesh; of a fine one without details that nobody sees."""
    if len(faces) <= _FINE:
        return vertices, faces
    rounded, index = np.unique((vertices / _GRID).round(), axis=0, return_inverse=True)
    faces = index.ravel()[faces]
    corners = np.sort(faces, axis=1)
    whole = (corners[:, 0] < corners[:, 1]) & (corners[:, 1] < corners[:, 2])
    faces = faces[np.unique(np.where(whole[:, None], corners, 0), axis=0, return_index=True)[1]]
    return rounded * _GRID, faces[np.ptp(faces, axis=1) > 0]


def _pieces(vertices: FloatArray, faces: IntArray, scale: FloatArray) -> Iterator[MeshPiece]:
    """Yield the connected pieces of a mesh, without those that are flat, coloured by their form."""
    edges = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(vertices),) * 2)
    count, labels = connected_components(graph, directed=False)
    kept = (labels == label for label in range(count))
    solid = [keep for keep in kept if np.ptp(vertices[keep], axis=0).min() > 1e-3]
    for keep in solid:
        renumbered, own = np.cumsum(keep) - 1, vertices[keep]
        rgba = _colour(own) if len(solid) > 1 else _JOINT
        yield MeshPiece(own * scale, renumbered[faces[keep[faces[:, 0]]]], rgba)


def _read_stl(path: Path) -> tuple[FloatArray, IntArray]:
    corners = _corners(path)
    if corners is None:
        raise HandrailError(f"mesh {path}: expected a binary STL file")
    vertices, index = np.unique(corners.round(7), axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 3)


def _corners(path: Path) -> FloatArray | None:
    """Return the corners of the triangles of a binary STL file, (3 f, 3); None of another file."""
    with open_regular(path) as file:
        data = file.read()
    count = int.from_bytes(data[80:84], "little")
    if len(data) < 84 + count * _TRIANGLE.itemsize:
        return None
    corners = np.frombuffer(data, _TRIANGLE, count, 84)["vertices"].reshape(-1, 3).astype(float)
    if not np.abs(corners).max(initial=0.0) < _LARGEST:
        raise HandrailError(f"mesh {path}: expected finite coordinates of sane size, got others")
    return corners


def _colour(vertices: FloatArray) -> tuple[float, ...]:
    """Return a slender piece's colour, a tube's, a flat one's, a cap's, or a joint housing's."""
    low, middle, high = np.sort(np.ptp(vertices, axis=0))
    return _TUBE if high > 2.0 * middle else _CAP if low < 0.75 * middle else _JOINT

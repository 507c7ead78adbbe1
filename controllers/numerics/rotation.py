"""Rotations: matrices, quaternions (wxyz), rotation vectors.

Numbers are SciPy's, bit for bit. What is asked many times in a control period is in the compiled core: for
one matrix SciPy's own functions take most of their time to check it.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from handrail.controllers.arrays import FloatArray
from handrail.controllers.core.library import functions


def turned(planar: ArrayLike, angle: ArrayLike) -> FloatArray:
    """Return planar vectors or twists turned about z: `(c x − s y, s x + c y)`; what comes after x, y stays.

    By the base's yaw it takes them from the base frame to the world, by minus that back.

    Args:
        planar: (2, …) or, as (vx, vy, ωz) or a matrix of such columns, (3, …).
        angle: [rad], one, or one a column.
    """
    x, y, *rest = np.asarray(planar)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * x - s * y, s * x + c * y, *rest])


def matrix_from_rpy(rpy: ArrayLike) -> FloatArray:
    """Return `Rz(yaw) Ry(pitch) Rx(roll)` as URDF defines it; angles [rad]."""
    return Rotation.from_euler("xyz", np.asarray(rpy, dtype=float)).as_matrix()


def matrix_to_axis(axis: ArrayLike) -> FloatArray:
    """Return a rotation whose z column is the unit vector `axis`."""
    z = np.asarray(axis, dtype=float)
    helper = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def quaternion_from_matrix(matrix: ArrayLike) -> FloatArray:
    """Return the unit quaternion (w, x, y, z) with w >= 0, (4,)."""
    x, y, z, w = _quaternion(matrix)
    quaternion = np.array([w, x, y, z])
    return quaternion if w >= 0 else -quaternion


def matrix_from_quaternion(quaternion: ArrayLike) -> FloatArray:
    """Return the rotation matrix of a quaternion (w, x, y, z), (3, 3)."""
    w, x, y, z = np.asarray(quaternion, dtype=float)
    return Rotation.from_quat([x, y, z, w]).as_matrix()


def matrix_from_vector(vector: ArrayLike) -> FloatArray:
    """Return the rotation matrix of a rotation vector (axis times angle) [rad], (3, 3)."""
    return Rotation.from_rotvec(np.asarray(vector, dtype=float)).as_matrix()


def rotation_vector(matrix: ArrayLike) -> FloatArray:
    """Return the rotation vector (axis times angle) [rad] of a rotation matrix, (3,)."""
    vector = np.empty(3)
    functions().vector_of(_quaternion(matrix), vector)
    return vector


def _quaternion(matrix: ArrayLike) -> FloatArray:
    """Return (x, y, z, w) of a rotation matrix, (3, 3); SciPy finds the nearest rotation where it is none."""
    given, quaternion = np.ascontiguousarray(matrix, dtype=float), np.empty(4)
    if given.shape == (3, 3) and functions().quaternion_of(given, quaternion):
        return quaternion
    return Rotation.from_matrix(given).as_quat()

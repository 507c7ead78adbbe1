"""Rotations: matrices, quaternions (wxyz), rotation vectors.

Functions called many times in a control period are in the compiled core: for
one matrix SciPy's own functions take most of their time to check it.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from handrail.controllers.arrays import FloatArray
from handrail.controllers.core.library import functions

_NO_TURN = np.eye(3)


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
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


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


def matrix_from_vector(vector: ArrayLike) -> FloatArray:
    """Return the rotation matrix of a rotation vector θ a [rad], (3, 3).

    `I + sin θ / θ [θ a]× + (1 − cos θ) / θ² [θ a]×²`.
    """
    turn = np.asarray(vector, dtype=float)
    angle, cross = math.pi * (math.sqrt(turn.dot(turn)) / math.pi or 1e-20), _cross_matrix(*turn.tolist())
    half = math.sin(0.5 * angle) / (0.5 * angle)
    return _NO_TURN + math.sin(angle) / angle * cross + 0.5 * half**2 * cross @ cross


def rotation_vector(matrix: ArrayLike) -> FloatArray:
    """Return the rotation vector (axis times angle) [rad] of a rotation matrix, (3,)."""
    given, vector = np.ascontiguousarray(matrix, dtype=float), np.empty(3)
    if not (given.shape == (3, 3) and functions().rotation_vector_of(given, vector)):
        functions().vector_of(_quaternion(given), vector)
    return vector


def _cross_matrix(x: float, y: float, z: float) -> FloatArray:
    """Return `[r]×`, (3, 3): `[r]× s = r × s`."""
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _quaternion(matrix: ArrayLike) -> FloatArray:
    """Return (x, y, z, w) of a rotation matrix, (3, 3); SciPy finds the nearest rotation where it is none."""
    given, quaternion = np.ascontiguousarray(matrix, dtype=float), np.empty(4)
    if given.shape == (3, 3) and functions().quaternion_of(given, quaternion):
        return quaternion
    from scipy.spatial.transform import Rotation  # half of the time that importing the controller would take

    return Rotation.from_matrix(given).as_quat()

"""Rotations: matrices, quaternions (wxyz), rotation vectors.

Numbers are SciPy's, bit for bit. What is asked many times in a control period is compiled: for one matrix
SciPy's own functions take most of their time to check it.
"""

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.jit import exact_jit

_ORTHOGONAL = 1e-12  # else SciPy finds the nearest rotation


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
    given = np.ascontiguousarray(matrix, dtype=float)
    if given.shape == (3, 3) and _is_rotation(given):
        x, y, z, w = _quaternion(given)
    else:
        x, y, z, w = Rotation.from_matrix(given).as_quat()
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
    given = np.ascontiguousarray(matrix, dtype=float)
    if given.shape == (3, 3) and _is_rotation(given):
        return _vector(_quaternion(given))
    return Rotation.from_matrix(given).as_rotvec()


@exact_jit
def _is_rotation(R):
    """Whether rows are orthonormal and right-handed, (3, 3)."""
    for i in range(3):
        for j in range(i + 1):
            product = R[i, 0] * R[j, 0] + R[i, 1] * R[j, 1] + R[i, 2] * R[j, 2]
            if not abs(product - (i == j)) <= _ORTHOGONAL:
                return False
    minor = R[1, 1] * R[2, 2] - R[1, 2] * R[2, 1], R[1, 2] * R[2, 0] - R[1, 0] * R[2, 2]
    return R[0, 0] * minor[0] + R[0, 1] * minor[1] + R[0, 2] * (R[1, 0] * R[2, 1] - R[1, 1] * R[2, 0]) > 0.0


@exact_jit
def _quaternion(R):
    """Return (x, y, z, w) of a rotation matrix, (3, 3), by way of its largest entry (Markley, 2008)."""
    q, trace = np.empty(4), R[0, 0] + R[1, 1] + R[2, 2]
    i = 0
    for k in (1, 2):
        if R[k, k] > R[i, i]:
            i = k
    if trace > R[i, i]:
        q[0], q[1], q[2] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
        q[3] = 1.0 + trace
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        q[i], q[j], q[k] = 1.0 - trace + 2.0 * R[i, i], R[j, i] + R[i, j], R[k, i] + R[i, k]
        q[3] = R[k, j] - R[j, k]
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for k in range(4):
        q[k] /= norm
    return q


@exact_jit
def _vector(q):
    """Return the rotation vector of a unit quaternion (x, y, z, w), (4,), its angle at most π."""
    sign = -1.0 if q[3] < 0.0 else 1.0
    angle = 2.0 * math.atan2(math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]), sign * q[3])
    if angle <= 1e-3:
        scale = 2.0 + angle * angle / 12.0 + 7.0 * (angle * angle) * (angle * angle) / 2880.0
    else:
        scale = angle / math.sin(angle / 2.0)
    return (sign * scale) * q[:3]

"""Rotations: matrices, quaternions (wxyz), rotation vectors.

What is asked many times in a control period is in the compiled core: for
one matrix SciPy's own functions take most of their time to check it.
"""

import numpy as np
from numpy.typing import ArrayLike

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


def matrix_from_quaternion(quaternion: ArrayLike) -> FloatArray:
    """Return the rotation matrix of a quaternion (w, x, y, z), (3, 3): `I + 2 w [r]× + 2 [r]×²`, |q| = 1."""
    w, *r = np.asarray(quaternion, dtype=float) / np.linalg.norm(quaternion)
    cross = np.cross(np.eye(3), r)
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross


def matrix_from_vector(vector: ArrayLike) -> FloatArray:
    """Return the rotation matrix of a rotation vector θ a [rad], (3, 3).

    `I + sin θ / θ [θ a]× + (1 − cos θ) / θ² [θ a]×²`.
    """
    turn = np.asarray(vector, dtype=float)
    share, cross = np.linalg.norm(turn) / np.pi, np.cross(np.eye(3), turn)
    return np.eye(3) + np.sinc(share) * cross + 0.5 * np.sinc(0.5 * share) ** 2 * cross @ cross


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
    from scipy.spatial.transform import Rotation  # half of the time that importing the controller would take

    return Rotation.from_matrix(given).as_quat()

"""Quaternions and rotation vectors are SciPy's, bit for bit, whatever the matrix."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handrail.controllers.numerics.rotation import (
    matrix_from_rpy,
    matrix_from_vector,
    quaternion_from_matrix,
    rotation_vector,
)

ANGLES = (0.0, 1e-12, 1e-6, 9.9e-4, 1.1e-3, 0.3, 2.0, np.pi - 1e-3, np.pi - 1e-9, np.pi)


def rotations():
    """Yield rotation matrices by every angle about many axes, and products of them."""
    rng = np.random.default_rng(0)
    for angle in ANGLES:
        for axis in (*np.eye(3), *-np.eye(3), *rng.standard_normal((30, 3))):
            matrix = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
            yield matrix
            yield matrix @ Rotation.random(rng=rng).as_matrix().T


def test_matrices_are_scipys_but_for_rounding():
    rng = np.random.default_rng(1)
    for size in (1e-9, 1e-3, 1.0, np.pi, 4.0):
        three = size * rng.standard_normal(3)
        pairs = [
            (matrix_from_rpy(three), Rotation.from_euler("xyz", three)),
            (matrix_from_vector(three), Rotation.from_rotvec(three)),
        ]
        for found, expected in pairs:
            np.testing.assert_allclose(found, expected.as_matrix(), atol=1e-15)
    np.testing.assert_array_equal(matrix_from_vector(np.zeros(3)), np.eye(3))


def shortest(quaternion):
    """Return a quaternion (x, y, z, w) as (w, x, y, z) with w >= 0."""
    w_first = np.roll(quaternion, 1)
    return w_first if w_first[0] >= 0 else -w_first


def test_numbers_are_scipys():
    for matrix in rotations():
        expected = Rotation.from_matrix(matrix)
        for given in (matrix, np.asfortranarray(matrix), matrix.tolist()):
            assert quaternion_from_matrix(given).tolist() == shortest(expected.as_quat()).tolist()
            assert rotation_vector(given).tolist() == expected.as_rotvec().tolist()


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-3])
def test_a_matrix_that_is_nearly_one_is_the_nearest_rotation(size):
    rng = np.random.default_rng(1)
    for _ in range(20):
        matrix = Rotation.random(rng=rng).as_matrix() + size * rng.standard_normal((3, 3))
        expected = Rotation.from_matrix(matrix)
        assert quaternion_from_matrix(matrix).tolist() == shortest(expected.as_quat()).tolist()
        assert rotation_vector(matrix).tolist() == expected.as_rotvec().tolist()


@pytest.mark.parametrize("ask", [quaternion_from_matrix, rotation_vector])
@pytest.mark.parametrize("wrong", [np.diag([1.0, 1.0, -1.0]), np.zeros((3, 3))])
def test_a_matrix_that_is_no_rotation_is_refused(ask, wrong):
    with pytest.raises(ValueError, match="determinant"):
        ask(wrong)

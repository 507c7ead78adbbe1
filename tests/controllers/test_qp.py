"""Laws of the banded QP: the basis, the factor, and the active-set method against a dense solver."""

import daqp
import numpy as np
import pytest

from handrail.controllers.collision.slacks import LIMITS, SLACKS
from handrail.controllers.solvers import active_set
from handrail.controllers.solvers.active_rows import active_rows
from handrail.controllers.solvers.banded import backward, factor, forward
from handrail.controllers.solvers.basis import REACH, stage_matrix, to_motion
from handrail.controllers.solvers.constraints import Constraints, first_distance, write_row

DT, N = 0.1, 3  # N coordinates
NONE = np.arange(SLACKS)  # the rows that an update begins with


def dense(band):
    size, width = band.shape
    matrix = np.zeros((size, size))
    for j in range(size):
        for t in range(min(width, size - j)):
            matrix[j + t, j] = matrix[j, j + t] = band[j, t]
    return matrix


def random_band(rng, horizon):
    """A Hessian like those of an update: stage costs of (q, v, u) with weights of many sizes."""
    size = horizon * N
    matrix = np.zeros((size, size))
    motion = np.zeros((horizon, 3, N))
    basis = np.zeros((horizon, 3 * N, size))
    for column, unit in enumerate(np.eye(size)):
        to_motion(stage_matrix(DT), unit, motion)
        basis[:, :, column] = motion.reshape(horizon, -1)
    for stage in basis:
        rows = np.vstack([30.0 * rng.normal(size=(2, 3 * N)) @ stage, 0.3 * stage[N:]])
        matrix += rows.T @ rows
    band = np.zeros((size, REACH * N))
    for j in range(size):
        for t in range(min(REACH * N, size - j)):
            band[j, t] = matrix[j + t, j]
    return band


def random_rows(rng, horizon, distances, tight):
    coefficients = 0.01 * rng.normal(size=(distances, REACH * N))
    coefficients[:, :N] = 0.0  # positions do not depend on the stage before the last
    return Constraints(
        matrix=stage_matrix(DT),
        guess=rng.uniform(-1, 1, (horizon, N)),
        acceleration=rng.uniform(0.5, 2.0, N),
        offsets=rng.uniform(-0.95, 0.95, (horizon, 2, N)),
        scales=rng.uniform(0.5, 2.0, (2, N)),
        stage=rng.integers(0, horizon, distances),
        kind=rng.integers(0, LIMITS, distances),
        coefficients=coefficients,
        upper=rng.uniform(-tight, 0.1, distances),
    )


def reference(band, gradient, penalty, rows):
    """The same QP, dense, by DAQP: (s, σ), all rows and right-hand sides."""
    size = len(gradient)
    count = first_distance(*rows.guess.shape) + len(rows.upper)
    matrix, upper = np.zeros((count, size + SLACKS)), np.zeros(count)
    for key in range(count):
        upper[key], _ = write_row(rows, key, matrix[key])
    hessian = np.diag(np.full(size + SLACKS, penalty[1]))
    hessian[:size, :size] = dense(band)
    linear = np.concatenate([gradient, np.full(SLACKS, penalty[0])])
    sense = np.zeros(count, dtype=np.int32)
    x, _, flag, _ = daqp.solve(hessian, linear, matrix, upper, np.full(count, -1e30), sense)
    assert flag > 0
    return x, hessian, linear, matrix, upper


def solve(band, gradient, penalty, rows, warm=NONE, limit=2000):
    triangle = band.copy()
    assert factor(triangle)
    held, motion = active_rows(len(rows.guess), N), np.zeros((len(rows.guess), 3, N))
    slack, descent, solved, changes, count = active_set.solve(
        triangle, gradient, penalty, rows, warm, limit, held, motion
    )
    q = motion[:, 0] / (0.5 * DT**2)  # s_k + s_{k-1}
    s = np.empty_like(q)
    for k in range(len(q)):
        s[k] = q[k] - (s[k - 1] if k else 0.0)
    s = s.ravel()
    if solved:
        np.testing.assert_allclose(descent, gradient @ s + 0.5 * s @ dense(band) @ s, rtol=1e-6, atol=1e-6)
    return np.append(s, slack), solved, changes, held.keys[:count].copy(), held, motion


def test_the_basis_obeys_the_dynamics():
    rng = np.random.default_rng(0)
    motion = np.zeros((6, 3, N))
    to_motion(stage_matrix(DT), rng.normal(size=6 * N), motion)
    q, v, u = motion.transpose(1, 0, 2)
    before = np.vstack([np.zeros((1, N)), v[:-1]])
    np.testing.assert_allclose(v, before + DT * u, atol=1e-12)
    np.testing.assert_allclose(q, np.cumsum(DT * before + 0.5 * DT**2 * u, axis=0), atol=1e-12)


def test_the_factor_is_the_factor():
    rng = np.random.default_rng(1)
    band = random_band(rng, 8)
    matrix, triangle = dense(band), band.copy()
    assert factor(triangle)
    right = rng.normal(size=len(band))
    x = right.copy()
    forward(triangle, x, 0)
    np.testing.assert_allclose(np.linalg.cholesky(matrix) @ x, right, rtol=1e-9, atol=1e-9)
    backward(triangle, x)
    np.testing.assert_allclose(matrix @ x, right, rtol=1e-7, atol=1e-7)
    assert not factor(-band)
    assert not factor(np.full_like(band, np.nan))


@pytest.mark.parametrize("horizon", [2, 5, 12])
@pytest.mark.parametrize("tight", [0.0, 0.05])  # the second needs slack
def test_the_solution_is_that_of_a_dense_solver(horizon, tight):
    rng = np.random.default_rng(horizon)
    penalty = (1e5, 1e5)
    slacks = 0
    for _ in range(10):
        band, rows = random_band(rng, horizon), random_rows(rng, horizon, 40, tight)
        gradient = 30.0 * rng.normal(size=horizon * N)
        x, solved, changes, keys, held, motion = solve(band, gradient, penalty, rows)
        expected, hessian, linear, matrix, upper = reference(band, gradient, penalty, rows)
        assert solved
        assert changes > 0
        assert np.all(matrix @ x <= upper + 2e-5)
        assert np.all(held.multipliers[: len(keys)] > -1e-6)
        costs = [0.5 * z @ hessian @ z + linear @ z for z in (x, expected)]
        np.testing.assert_allclose(*costs, rtol=1e-6)
        exact = np.zeros_like(motion)
        to_motion(rows.matrix, x[:-SLACKS], exact)
        np.testing.assert_allclose(motion, exact, atol=1e-9)
        slacks += np.any(x[-SLACKS:] > 1e-6)
        again, solved, changes, *_ = solve(band, gradient, penalty, rows, warm=keys)
        assert solved
        assert changes == 0  # begun with the right rows there is nothing to change
        np.testing.assert_allclose(again, x, atol=1e-7)
        wrong = rng.integers(0, first_distance(horizon, N) + 40, 12)
        again, solved, *_ = solve(band, gradient, penalty, rows, warm=wrong)  # with any rows
        assert solved
        np.testing.assert_allclose(again, x, atol=1e-6)
    assert (slacks > 0) == (tight > 0.0)


def test_rows_that_are_the_same_twice_do_no_harm():
    rng = np.random.default_rng(5)
    band, rows = random_band(rng, 6), random_rows(rng, 6, 10, 0.05)
    twice = rows._replace(
        stage=np.tile(rows.stage, 3),
        kind=np.tile(rows.kind, 3),
        coefficients=np.tile(rows.coefficients, (3, 1)),
        upper=np.tile(rows.upper, 3),
    )
    gradient = 30.0 * rng.normal(size=18)
    once, solved, *_ = solve(band, gradient, (1e5, 1e5), rows)
    assert solved
    again, solved, *_ = solve(band, gradient, (1e5, 1e5), twice)
    assert solved
    np.testing.assert_allclose(again, once, atol=1e-6)


def test_too_many_changes_are_no_solution():
    rng = np.random.default_rng(6)
    band, rows = random_band(rng, 6), random_rows(rng, 6, 40, 0.05)
    gradient = 30.0 * rng.normal(size=18)
    _, solved, changes, *_ = solve(band, gradient, (1e5, 1e5), rows)
    assert solved
    assert not solve(band, gradient, (1e5, 1e5), rows, limit=changes // 2)[1]

"""Laws of the banded QP: the basis, the factor, and the active-set method against a dense solver."""

import daqp
import numpy as np
import pytest

from handrail.controllers.collision.slacks import LIMITS, SLACKS
from handrail.controllers.solvers.active_rows import active_rows
from handrail.controllers.solvers.active_set import ActiveSet, QuadraticProgram, solve
from handrail.controllers.solvers.banded import backward, factor, forward
from handrail.controllers.solvers.basis import REACH, stage_matrix, to_motion
from handrail.controllers.solvers.constraints import Constraints
from handrail.controllers.solvers.dense import dense

DT, N = 0.1, 3  # N coordinates
NONE = np.arange(SLACKS)  # the rows that an update begins with


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
    value = rng.uniform(-1, 1, (horizon, 3, N)) * np.array([[0.95], [0.95], [1.0]])
    first = SLACKS + 2 * value.size
    return Constraints(
        stage_matrix(DT),
        value,
        rng.uniform(0.5, 2.0, (3, N)),
        stage=rng.integers(0, horizon, distances),
        kind=rng.integers(0, LIMITS, distances),
        coefficients=coefficients,
        left=rng.uniform(-tight, 0.1, distances),
        row=first + 5 + rng.permutation(distances),
        first=first,
        broken=False,
    )


def random_program(rng, horizon, distances, tight):
    band, constraints = random_band(rng, horizon), random_rows(rng, horizon, distances, tight)
    return QuadraticProgram(band, 30.0 * rng.normal(size=horizon * N), (1e5, 1e5), constraints)


def reference(program):
    """The same QP, dense, and its solution by DAQP: (s, σ)."""
    same = dense(program)
    least, sense = np.full(len(same.upper), -1e30), np.zeros(len(same.upper), dtype=np.int32)
    x, _, flag, _ = daqp.solve(same.hessian, same.gradient, same.matrix, same.upper, least, sense)
    assert flag > 0
    return x, same


def solved_by_ours(program, warm=NONE, limit=2000):
    same, factored = dense(program), program._replace(band=program.band.copy())
    assert factor(factored.band)
    horizon = len(program.gradient) // N
    held, motion = active_rows(horizon, N), np.zeros((horizon, 3, N))
    slack, descent, solved, changes, count, _ = solve(factored, warm, limit, np.inf, held, motion)
    s = variables(motion)
    if solved:
        hessian = same.hessian[: len(s), : len(s)]
        np.testing.assert_allclose(
            descent, program.gradient @ s + 0.5 * s @ hessian @ s, rtol=1e-6, atol=1e-6
        )
    return np.append(s, slack), solved, changes, held.rows[:count].copy(), held, motion


def variables(motion):
    q = motion[:, 0] / (0.5 * DT**2)  # s_k + s_{k-1}
    s = np.empty_like(q)
    for k in range(len(q)):
        s[k] = q[k] - (s[k - 1] if k else 0.0)
    return s.ravel()


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
    program = random_program(rng, 8, 0, 0.0)
    band, matrix = program.band, dense(program).hessian[:-SLACKS, :-SLACKS]
    triangle = band.copy()
    assert factor(triangle)
    right = rng.normal(size=len(band))
    x = right.copy()
    forward(triangle, x, 0)
    np.testing.assert_allclose(np.linalg.cholesky(matrix) @ x, right, rtol=1e-9, atol=1e-8)
    backward(triangle, x)
    np.testing.assert_allclose(matrix @ x, right, rtol=1e-7, atol=1e-7)
    assert not factor(-band)
    assert not factor(np.full_like(band, np.nan))


@pytest.mark.parametrize("horizon", [2, 5, 12])
@pytest.mark.parametrize("tight", [0.0, 0.05])  # the second needs slack
def test_the_solution_is_that_of_a_dense_solver(horizon, tight):
    rng = np.random.default_rng(horizon)
    slacks = 0
    for _ in range(10):
        program = random_program(rng, horizon, 40, tight)
        x, solved, changes, rows, held, motion = solved_by_ours(program)
        expected, same = reference(program)
        assert solved
        assert changes > 0
        assert same.violation(x) <= 2e-5
        assert np.all(held.multipliers[: len(rows)] > -1e-6)
        np.testing.assert_allclose(same.value(x), same.value(expected), rtol=1e-6)
        exact = np.zeros_like(motion)
        to_motion(stage_matrix(DT), x[:-SLACKS], exact)
        np.testing.assert_allclose(motion, exact, atol=1e-9)
        slacks += np.any(x[-SLACKS:] > 1e-6)
        again, solved, changes, *_ = solved_by_ours(program, warm=rows)
        assert solved
        assert changes == 0  # begun with the right rows there is nothing to change
        np.testing.assert_allclose(again, x, atol=1e-7)
        wrong = rng.integers(0, same.rows.max() + 5, 12)  # any rows, and such as do not exist
        again, solved, *_ = solved_by_ours(program, warm=np.unique(wrong))
        assert solved
        np.testing.assert_allclose(again, x, atol=1e-6)
    assert (slacks > 0) == (tight > 0.0)


def test_a_qp_begins_with_the_rows_that_were_active():
    program = random_program(np.random.default_rng(7), 6, 40, 0.05)
    qp = ActiveSet(6, N)
    first = qp.solve(program._replace(band=program.band.copy()))
    again = qp.solve(program._replace(band=program.band.copy()), first.active)
    assert first.solved
    assert first.changes > 0
    assert again.solved
    assert again.changes == 0
    assert qp.solve(program._replace(band=program.band.copy())).changes == first.changes


def test_work_is_counted_and_where_it_ends_the_rows_met_so_far_hold():
    program = random_program(np.random.default_rng(7), 6, 40, 0.05)
    qp = ActiveSet(6, N)

    def solved(work):
        return qp.solve(program._replace(band=program.band.copy()), work=work)

    def cost(answer):
        linear, quadratic = program.penalty
        return answer.descent + linear * answer.slack.sum() + 0.5 * quadratic * answer.slack @ answer.slack

    whole = solved(1e9)
    spent = 1e9 - whole.work_left
    assert solved(1e9).work_left == whole.work_left  # no clock
    assert solved(1.01 * spent).changes == whole.changes
    for share in (0.2, 0.5, 0.8):
        part = solved(share * spent)
        assert part.solved
        assert part.work_left <= 0.0
        assert part.changes < whole.changes
        assert cost(part) < cost(whole)  # fewer rows hold it back: the cost falls farther


def test_a_hessian_that_is_not_positive_is_no_solution():
    program = random_program(np.random.default_rng(8), 6, 10, 0.0)
    assert not ActiveSet(6, N).solve(program._replace(band=-program.band)).solved


def test_rows_that_are_the_same_twice_do_no_harm():
    program = random_program(np.random.default_rng(5), 6, 10, 0.05)
    near = program.constraints
    thrice = near._replace(
        stage=np.tile(near.stage, 3),
        kind=np.tile(near.kind, 3),
        coefficients=np.tile(near.coefficients, (3, 1)),
        left=np.tile(near.left, 3),
        row=near.first + np.arange(3 * len(near.row)),
    )
    once, solved, *_ = solved_by_ours(program)
    assert solved
    again, solved, *_ = solved_by_ours(program._replace(constraints=thrice))
    assert solved
    np.testing.assert_allclose(again, once, atol=1e-6)


def test_too_many_changes_are_no_solution():
    program = random_program(np.random.default_rng(6), 6, 40, 0.05)
    _, solved, changes, *_ = solved_by_ours(program)
    assert solved
    assert not solved_by_ours(program, limit=changes // 2)[1]

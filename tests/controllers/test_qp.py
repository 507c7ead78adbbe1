"""Laws of the banded QP in the compiled core: basis, factor, active-set method against a dense solver."""

from typing import Any

import daqp
import numpy as np
import pytest
from plans import cost, violation

from handrail.controllers.collision.slacks import LIMITS, SLACKS
from handrail.controllers.core.library import Memory, functions
from handrail.controllers.solvers.converged import stage_matrix
from handrail.controllers.solvers.dense import dense
from handrail.controllers.solvers.real_time import NOTHING_ACTIVE

DT, N = 0.1, 3  # N coordinates


class Program:
    """A random QP in a core of its own: stage costs with weights of many sizes, and near pairs."""

    def __init__(self, rng, horizon, distances, tight):
        size = horizon * N
        sizes = {"N": horizon, "n": N, "K": horizon + 3, "M": size, "V": size + SLACKS, "B": 3 * N}
        self.core = core = Memory("Core", sizes | {"P": distances, "R": 0, "A": 0, "E": 0, "C": 0})
        self.scene = Memory("Scene", {"n": N, "S": 0, "P": distances})
        core.fields.dt, core.fields.linear, core.fields.quadratic = DT, 1e5, 1e5
        self.band, core.slope[:] = self._band(rng), 30.0 * rng.normal(size=size)
        core.joint_value[:] = rng.uniform(-1, 1, (horizon, 3, N)) * np.array([[0.95], [0.95], [1.0]])
        core.joint_scale[:] = rng.uniform(0.5, 2.0, (3, N))
        self.scene.slack[:] = rng.integers(0, LIMITS, distances)
        core.fields.count, core.gains[:] = distances, 0.3
        core.near[:distances] = np.column_stack(
            [rng.integers(1, horizon + 3, distances), np.arange(distances)]
        )
        core.gradient[:distances] = rng.normal(size=(distances, N))
        core.left[:distances] = rng.uniform(-tight, 0.1, distances)
        core.number[:distances] = SLACKS + 6 * size + 5 + rng.permutation(distances)
        core.band[:] = self.band
        self.dense = dense(core, self.scene)

    def motion(self, s):
        found = np.zeros_like(self.core.motion)
        functions().to_motion(self.core, np.array(s), found)
        return found

    def solve(self, active=NOTHING_ACTIVE, work=np.inf) -> Any:
        """Return the solution (s, σ), or None where there is none."""
        core = self.core
        core.band[:], core.active[: len(active)] = self.band, active
        core.fields.active_rows, core.fields.work = len(active), work
        solved = functions().solve_program(core, self.scene)
        return np.append(core.s, core.slacks) if solved else None

    @property
    def active(self):
        return self.core.active[: self.core.fields.active_rows].copy()

    def _band(self, rng):
        size, horizon = self.core.fields.M, self.core.fields.N
        matrix, basis = np.zeros((size, size)), np.zeros((horizon, 3 * N, size))
        for column, unit in enumerate(np.eye(size)):
            basis[:, :, column] = self.motion(unit).reshape(horizon, -1)
        for stage in basis:
            rows = np.vstack([30.0 * rng.normal(size=(2, 3 * N)) @ stage, 0.3 * stage[N:]])
            matrix += rows.T @ rows
        band = np.zeros((size, 3 * N))
        for j in range(size):
            column = matrix[j : j + 3 * N, j]
            band[j, : len(column)] = column
        return band


def reference(same):
    """The solution (s, σ) of a dense QP by DAQP."""
    least, sense = np.full(len(same.upper), -1e30), np.zeros(len(same.upper), dtype=np.int32)
    x, _, flag, _ = daqp.solve(same.hessian, same.gradient, same.matrix, same.upper, least, sense)
    assert flag > 0
    return x


def test_the_basis_obeys_the_dynamics():
    rng = np.random.default_rng(0)
    program, s = Program(rng, 6, 0, 0.0), rng.normal(size=6 * N)
    q, v, u = program.motion(s).transpose(1, 0, 2)
    before = np.vstack([np.zeros((1, N)), v[:-1]])
    np.testing.assert_allclose(v, before + DT * u, atol=1e-12)
    np.testing.assert_allclose(q, np.cumsum(DT * before + 0.5 * DT**2 * u, axis=0), atol=1e-12)
    three = np.stack([np.vstack([np.zeros((2 - a, N)), s.reshape(6, N)[: 6 - 2 + a]]) for a in range(3)])
    np.testing.assert_allclose(
        program.motion(s), np.einsum("pa,akn->kpn", stage_matrix(DT), three), atol=1e-12
    )


def test_the_factor_is_the_factor():
    program = Program(np.random.default_rng(1), 8, 0, 0.0)
    triangle, size = program.band.copy(), program.core.fields.M
    assert functions().factor(triangle, *triangle.shape)
    expected = np.linalg.cholesky(program.dense.hessian[:size, :size])
    for j in range(size):
        column = expected[j : j + 3 * N, j]
        np.testing.assert_allclose(triangle[j, : len(column)], column, rtol=1e-7, atol=1e-7)
    for wrong in (-program.band, np.full_like(program.band, np.nan)):
        assert not functions().factor(wrong, *wrong.shape)


@pytest.mark.parametrize("horizon", [1, 2, 5, 12])
@pytest.mark.parametrize("tight", [0.0, 0.05])  # the second needs slack
def test_the_solution_is_that_of_a_dense_solver(horizon, tight):
    rng = np.random.default_rng(horizon)
    slacks = 0
    for _ in range(10):
        program = Program(rng, horizon, 40, tight)
        x, same = program.solve(), program.dense
        core, expected = program.core, reference(same)
        assert core.fields.changes > 0
        assert violation(same, x) <= 2e-5
        assert np.all(core.multipliers[: core.fields.active_rows] > -1e-6)
        np.testing.assert_allclose(cost(same, x), cost(same, expected), rtol=1e-6)
        np.testing.assert_allclose(core.motion, program.motion(x[:-SLACKS]), atol=1e-9)
        quadratic = 0.5 * x[:-SLACKS] @ same.hessian[:-SLACKS, :-SLACKS] @ x[:-SLACKS]
        np.testing.assert_allclose(
            core.fields.descent, core.slope @ x[:-SLACKS] + quadratic, rtol=1e-6, atol=1e-6
        )
        slacks += np.any(x[-SLACKS:] > 1e-6)
        np.testing.assert_allclose(program.solve(program.active), x, atol=1e-7)
        assert core.fields.changes == 0  # begun with the right rows there is nothing to change
        wrong = np.unique(rng.integers(0, same.rows.max() + 5, 8))  # any rows, and such as do not exist
        np.testing.assert_allclose(program.solve(wrong[: len(core.active)]), x, atol=1e-6)
    assert (slacks > 0) == (tight > 0.0)


def test_work_is_counted_and_where_it_ends_the_rows_met_so_far_hold():
    program = Program(np.random.default_rng(7), 6, 40, 0.05)
    fields = program.core.fields

    def solved(work):
        """Return how many changes it took, the work left, and the cost."""
        x = program.solve(work=work)
        assert x is not None
        return fields.changes, fields.work, cost(program.dense, x)

    changes, left, value = solved(1e9)
    spent = 1e9 - left
    assert solved(1e9)[1] == left  # no clock
    assert solved(1.01 * spent)[0] == changes
    for share in (0.2, 0.5, 0.8):
        fewer, rest, lower = solved(share * spent)
        assert rest <= 0.0
        assert fewer < changes
        assert lower < value  # fewer rows hold it back: the value falls farther


def test_a_hessian_that_is_not_positive_is_no_solution():
    program = Program(np.random.default_rng(8), 6, 10, 0.0)
    program.band = -program.band
    assert program.solve() is None


def test_rows_that_are_the_same_twice_do_no_harm():
    program = Program(np.random.default_rng(5), 6, 30, 0.05)
    core, ten = program.core, np.tile(np.arange(10), 3)
    core.near[:30], core.gradient[:30], core.left[:30] = core.near[ten], core.gradient[ten], core.left[ten]
    core.near[:30, 1] = np.arange(30)
    program.scene.slack[:] = program.scene.slack[ten]
    core.fields.count = 10
    once = program.solve()
    core.fields.count = 30
    np.testing.assert_allclose(program.solve(), once, atol=1e-6)

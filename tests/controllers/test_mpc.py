"""The masked MPC's laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from ideal_robot import CHANNELS, HOME, LIMITS, MODEL, REST, asking, realised, roll
from plans import is_solution

from handrail.controllers.core.library import functions
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.shape import Obstacle, Shape

MPC = MaskedMpc(MODEL)
POST = Obstacle("post", Shape("cylinder", [0.2, 1.2]), [0.4, 0.5, 0.6])
STILL = State(HOME, REST)


@settings(max_examples=30, deadline=None)
@given(
    arrays(float, 18, elements=st.floats(-1e6, 1e6)),
    arrays(bool, 18),
    arrays(float, 9, elements=st.floats(-1, 1)),
)
def test_accelerations_are_hard_limits_for_any_intent(values, mask, share):
    MPC.reset((POST,))
    state = State(HOME, 0.9 * share * LIMITS.velocity)
    command = MPC.update(state, Intent(values, mask))
    steps = np.diff(command.velocities, axis=0)
    assert np.all(np.abs(steps) <= LIMITS.acceleration * command.dt * (1 + 1e-6) + 1e-9)
    np.testing.assert_allclose(command.velocities[0], state.v)


@settings(max_examples=20, deadline=None)
@given(
    arrays(float, 18, elements=st.floats(-1, 1)),
    arrays(float, 18, elements=st.floats(allow_nan=True, allow_infinity=True)),
    arrays(bool, 18),
)
def test_masked_channels_never_change_the_plan(values, garbage, mask):
    plans = []
    for other in (np.zeros(18), garbage):
        MPC.reset()
        MPC.update(STILL, Intent(np.where(mask, values, other), mask))
        plans.append(MPC.plan.u)
    np.testing.assert_array_equal(*plans)


@pytest.mark.parametrize("groups", [("ee",), ("base",), ("joint",)])
def test_a_feasible_command_is_tracked(groups):
    MPC.reset()
    rng = np.random.default_rng(3)
    scale = 0.1
    values = rng.uniform(-scale, scale, 18)
    positions, velocities, _ = roll(MPC, [asking(values, *groups)] * 20)
    mask = CHANNELS.mask(*groups)
    error = np.linalg.norm((realised(positions[-1], velocities[-1]) - values)[mask]) / np.linalg.norm(
        values[mask]
    )
    assert error < 0.02


def test_nobody_commands_nothing_moves():
    MPC.reset()
    positions, _, _ = roll(MPC, [lambda time: Intent.idle(CHANNELS, time)] * 10)
    np.testing.assert_allclose(positions[-1], HOME, atol=1e-4)


def test_the_base_goes_round_an_obstacle_while_the_hand_keeps_its_course():
    """The paper's case A, one obstacle: a low cylinder in the way of the base."""
    low = Obstacle("low", Shape("cylinder", [0.3, 0.3]), [0.6, -0.25, 0.15])
    MPC.reset((low,))
    positions, velocities, commands = roll(MPC, [asking({"ee.vx": 0.3}, "ee")] * 160)
    moved = zip(positions, velocities, strict=True)
    errors = [np.linalg.norm(realised(q, v)[3:6] - [0.3, 0.0, 0.0]) for q, v in moved]
    assert np.mean(errors[20:]) < 0.01 * 0.3
    chassis = min(command.diagnostics.smallest_distance for command in commands)
    assert chassis > 0.05
    assert np.max(np.abs(positions[:, 1])) > 0.1  # it did go round


def test_the_quadratic_is_that_of_the_cost():
    """Gradient and Gauss-Newton Hessian of the QP against finite differences of the stage costs."""
    MPC.reset()
    rng = np.random.default_rng(7)
    mask = CHANNELS.mask("ee", "base", "joint")
    state = State(HOME + rng.uniform(-0.2, 0.2, 9), rng.uniform(-0.2, 0.2, 9))
    frames = Frames("world", "tool", [0.1, -0.2, 0.05])
    problem = MPC.build_problem(state, Intent(rng.uniform(-0.3, 0.3, 18), mask, frames=frames))
    u = rng.uniform(-0.5, 0.5, (10, 9))
    residual = MPC.residuals.expression

    def residuals(u):
        q, v = problem.rollout(u)
        z = np.hstack([q[1:], v[1:], u])
        r = np.array([np.array(residual(row, problem.parameters)).ravel() for row in z])
        return np.sqrt(problem.weights) * (r - problem.reference)

    q, v = problem.rollout(u)
    core = MPC.solver.program(problem, u)
    value = functions().build_program(core, problem.collision.memory)
    gradient, hessian = core.slope.copy(), core.band.copy()
    h, jacobian = 1e-6, []
    motion = np.zeros((10, 3, 9))
    for index in range(90):
        functions().to_motion(core, h * np.eye(90)[index], motion)  # a variable's accelerations
        step = motion[:, 2]
        jacobian.append(((residuals(u + step) - residuals(u - step)) / (2 * h)).ravel())
    jacobian = np.array(jacobian).T
    expected = jacobian.T @ jacobian
    width = hessian.shape[1]
    assert np.abs(expected[np.tril_indices(90, -width)]).max() < 1e-6  # nothing outside the band
    inside = [(i, j) for i in range(90) for j in range(max(0, i - width + 1), i + 1)]
    found = [hessian[j, i - j] for i, j in inside]
    band = [expected[i, j] for i, j in inside]
    np.testing.assert_allclose(value, 0.5 * np.sum(residuals(u) ** 2), rtol=1e-9)
    np.testing.assert_allclose(functions().cost_of(core, q, v, u), value, rtol=1e-12)
    np.testing.assert_allclose(gradient, jacobian.T @ residuals(u).ravel(), rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(found, band, rtol=1e-4, atol=1e-2)


def test_the_tests_check_of_a_solution_can_fail():
    MPC.reset()
    problem = MPC.build_problem(STILL, asking(np.full(18, 0.2), "ee")(0.0))
    MPC.update(STILL, asking(np.full(18, 0.2), "ee")(0.0))
    plan = MPC.plan
    assert is_solution(plan, problem)
    assert not is_solution(plan._replace(u=plan.u * 50.0), problem)
    assert not is_solution(plan._replace(q=plan.q + 0.1), problem)
    assert not is_solution(plan._replace(solved=False), problem)


def test_a_longer_horizon_is_a_setting():
    mpc = MaskedMpc(MODEL, MpcSettings(horizon=15, dt=0.08))
    command = mpc.update(STILL, asking(np.full(18, 0.2), "ee")(0.0))
    assert mpc.plan.v.shape == (16, 9)
    np.testing.assert_array_equal(command.plan.velocities, mpc.plan.v)
    np.testing.assert_array_equal(command.velocities[:2], mpc.plan.v[:2])  # what was certified, then the stop
    np.testing.assert_array_less(np.diff(np.abs(command.velocities[1:]), axis=0), 1e-12)
    np.testing.assert_array_equal(command.velocities[-1], 0.0)  # a command ends at rest
    assert command.dt == 0.08


def test_a_length_that_is_given_is_not_scaled():
    assert MpcSettings.of(0.3, margin=0.05).margin == 0.05

"""A joint beyond its range comes back; no other joint leaves its own for that."""

import numpy as np
import pytest
from ideal_robot import CHANNELS, HOME, LIMITS, MODEL, Robot, asking, without_shapes

from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.solvers.converged import ConvergedSolver

X, Y = 0, 1


def beyond(**joints):
    """Return home, some joints so far beyond their upper ends; below the lower ones where it is negative."""
    q = np.array(HOME)
    for name, excess in joints.items():
        index = MODEL.joints.index(name)
        q[index] = (LIMITS.position_upper if excess >= 0.0 else LIMITS.position_lower)[index] + excess
    return q


def excess_of(q):
    return np.maximum(q - LIMITS.position_upper, LIMITS.position_lower - q)


@pytest.mark.parametrize("group", ["joint", "joint.x"])
def test_a_joint_far_beyond_its_range_comes_back_and_lets_no_other_leave(group):
    """The base is 0.5 m beyond in y; somebody drives it in x against its end."""
    robot = Robot(MaskedMpc(MODEL), q=beyond(x=0.0, y=0.5))
    ask, farthest = asking({"joint.x": 1.0}, group), []
    for _ in range(120):
        assert robot.update(ask(robot.time)).diagnostics.status is Status.OK
        farthest.append(excess_of(robot.q)[X])
    assert max(farthest) < 1e-3
    assert excess_of(robot.q)[Y] < 1e-3


def test_two_joints_beyond_their_ranges_both_come_back():
    """One is farther beyond than the other, and must not push it out."""
    robot = Robot(MaskedMpc(MODEL), q=beyond(wrist_1_joint=0.1, wrist_2_joint=-0.3))
    ask, before = asking({}, "ee"), excess_of(robot.q)
    for _ in range(60):
        assert robot.update(ask(robot.time)).diagnostics.status is Status.OK
        assert np.all(excess_of(robot.q) <= np.maximum(before, 0.0) + 1e-3)
        before = excess_of(robot.q)
    assert np.all(excess_of(robot.q) < 1e-2)


@pytest.mark.parametrize("speed", [-0.5, 0.0, 0.5])
def test_both_solvers_let_a_joint_come_back_alike(speed):
    """It needs no slack, however fast it still goes away; nobody asks it to come back faster."""
    mpc = MaskedMpc(without_shapes(MODEL.description))
    q = beyond(y=0.5)
    v = np.array(np.arange(MODEL.size) == Y, dtype=float) * speed
    problem = mpc.build_problem(State(q, v), Intent.idle(CHANNELS))
    plan, guess = None, np.zeros((10, MODEL.size))
    for _ in range(20):
        plan = mpc.solver.solve(problem, guess)
        guess = plan.u
    converged = ConvergedSolver(mpc.residuals, 10, MODEL.size, mpc.settings.dt)
    best = converged.solve(problem, np.zeros((10, MODEL.size)))
    assert best.solved
    assert converged.evaluate(problem, guess).slack[-1] < 1e-4
    assert best.limit_slack < 1e-4
    np.testing.assert_allclose(guess / LIMITS.acceleration, best.u / LIMITS.acceleration, atol=5e-3)
    assert excess_of(plan.q)[:, Y].argmax() <= 5
    half = 0.5 * (LIMITS.position_upper - LIMITS.position_lower)
    assert (excess_of(plan.q)[1:] / half).max() <= plan.limit_slack + 1e-4

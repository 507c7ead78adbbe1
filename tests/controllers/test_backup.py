"""The backup's laws: whatever fails, the robot comes to rest without contact and inside its limits."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from ideal_robot import CHANNELS, HOME, LIMITS, MODEL, PERIOD, Robot, asking, clutter, table
from plans import is_solution

from handrail.controllers.baselines.cbf_filter import CbfFilter
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.build import resumed
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.controllers.safety import backup as safety
from handrail.controllers.safety.limiter import Limiter

MPC = MaskedMpc(MODEL)
LIMITER = Limiter(MODEL.description)
HONEST = MPC.solver.solve
FLOOR = 0.03 - 2e-3  # what the settings ask for, less what counts as no loss
AHEAD = asking(np.eye(18)[0] * 0.6, "base")


def reckless(joint):
    """Return a solver that speeds a joint up as fast as it can, whatever is in its way."""

    def solve(problem, guess, *active):
        ahead = problem.dt * LIMITS.acceleration[joint] * np.arange(1, 11)
        speeds = np.minimum(problem.v[joint] + ahead, LIMITS.velocity[joint])
        u = np.outer(np.diff(speeds, prepend=problem.v[joint]) / problem.dt, np.arange(9) == joint)
        q, v = problem.rollout(u)
        return HONEST(problem, guess)._replace(q=q, v=v, u=u)

    return solve


def raises(error):
    def solve(problem, guess, *active):
        raise error

    return solve


def unsolved(problem, guess, *active):
    return HONEST(problem, guess)._replace(solved=False)


def not_a_number(problem, guess, *active):
    plan = HONEST(problem, guess)
    return plan._replace(u=plan.u * np.nan, v=plan.v * np.nan, q=plan.q * np.nan)


FAILURES = [raises(HandrailError("no")), raises(RuntimeError("no")), unsolved, not_a_number]


def full_stop(robot):
    """Return the smallest distance to obstacles along the full stop from where the robot is now [m]."""
    collision = robot.controller.loop.surroundings.collision
    path, _ = safety.full_stop(LIMITER, robot.v, PERIOD).path(robot.q, 4)
    scene = np.array([second == "table" for _, second in collision.pairs])
    return float(collision.values(path)[:, scene].min())


def random_intent(rng):
    mask = CHANNELS.mask(*[("ee",), ("base",), ("base", "ee"), ("joint",)][rng.integers(4)])
    values = np.concatenate([[1, 1, 0.4], [0.6] * 3, [1] * 3, 0.5 * LIMITS.velocity]) * rng.uniform(-1, 1, 18)
    return lambda time: Intent(np.where(mask, values, 0.0), mask, time=time)


def assert_within_limits(robot):
    steps = np.abs(robot.steps)
    assert np.all(steps <= LIMITS.acceleration * robot.period * (1 + 1e-6) + 1e-9)
    assert all(np.all(np.abs(c.velocities) <= LIMITS.velocity + 1e-9) for c in robot.commands)


@pytest.mark.parametrize("height", [-0.05, 0.0])
def test_the_robot_drives_on_where_its_own_path_is_safe_and_a_full_stop_is_not(height):
    """Up to a table, the hand at the height of its edge: the arm rises while the base rolls on."""
    robot = Robot(MPC, (table(height),))
    stops = []
    for _ in range(100):
        command = robot.update(AHEAD(robot.time))
        assert command.diagnostics.status is Status.OK
        stops.append(full_stop(robot))
    assert min(stops) < FLOOR
    assert robot.smallest > FLOOR
    assert robot.q[0] - HOME[0] > 1.0


@pytest.mark.parametrize("jitter", [0.0, 0.005])
@pytest.mark.parametrize("height", [-0.05, 0.0])
@pytest.mark.parametrize("trouble", ["solver", "stale"])
def test_the_stored_plan_is_followed_where_a_full_stop_is_not_safe(monkeypatch, trouble, height, jitter):
    """The trouble comes at the worst moment of the same way; the clock of a real robot is not exact."""
    robot, stops = Robot(MPC, (table(height),)), []
    for _ in range(60):
        robot.update(AHEAD(robot.time))
        stops.append(full_stop(robot))
    worst = int(np.argmin(stops)) + 1
    robot = Robot(MPC, (table(height),))
    for _ in range(worst):
        robot.update(AHEAD(robot.time))
    assert full_stop(robot) < FLOOR
    if trouble == "solver":
        monkeypatch.setattr(MPC.solver, "solve", unsolved)
    for late in jitter * np.random.default_rng(0).random(50):
        now = robot.time + late
        command = robot.update(AHEAD(now - (trouble == "stale")), replace(robot.state, time=now))
        assert command.diagnostics.status is (
            Status.STALE_INTENT if trouble == "stale" else Status.SOLVER_FAILED
        )
    assert robot.smallest > FLOOR
    np.testing.assert_allclose(robot.v, 0.0, atol=1e-3)
    if not jitter:  # else the gate of the robot keeps them
        assert_within_limits(robot)


@pytest.mark.parametrize("speed", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(6))
def test_a_solver_that_fails_for_good_leaves_the_robot_at_rest_without_contact(monkeypatch, seed, speed):
    rng = np.random.default_rng([seed, int(10 * speed)])
    robot = Robot(MPC, clutter(rng, speed=speed))
    intent, updates = random_intent(rng), int(rng.integers(10, 60))
    for k in range(updates):
        if k % 12 == 11:
            intent = random_intent(rng)
        robot.update(intent(robot.time))
    monkeypatch.setattr(MPC.solver, "solve", FAILURES[seed % len(FAILURES)])
    while np.abs(robot.v).max() > 1e-9:
        assert robot.update(intent(robot.time)).diagnostics.status is Status.SOLVER_FAILED
        assert len(robot.commands) < updates + 45  # one stage and one stop, or a plan and one
    assert robot.smallest > 0.0
    assert_within_limits(robot)


@pytest.mark.parametrize("period", [0.02, 0.05, 0.07, 0.13])
def test_no_change_of_mind_exceeds_a_limit(monkeypatch, period):
    """Plans, what is stored and stops follow each other at random, at periods that divide no stage."""
    rng = np.random.default_rng(int(1000 * period))

    def moody(problem, guess, *active):
        return HONEST(problem, guess, *active) if rng.random() < 0.7 else unsolved(problem, guess)

    monkeypatch.setattr(MPC.solver, "solve", moody)
    robot = Robot(MPC, clutter(rng), period)
    for k in range(150):
        if k % 10 == 0:
            intent = random_intent(rng)
        trouble, state = rng.random(), None
        stamp = robot.time - 1.0 if trouble < 0.1 else robot.time
        if 0.1 < trouble < 0.15:
            state = replace(robot.state, q=np.full(9, np.nan))
        if 0.15 < trouble < 0.2 and k > 1:  # a period is known
            state = replace(robot.state, time=np.nan)
        robot.update(intent(stamp), state)
    statuses = {command.diagnostics.status for command in robot.commands}
    assert {Status.OK, Status.SOLVER_FAILED, Status.STALE_INTENT, Status.INVALID_STATE} <= statuses
    assert robot.smallest > 0.0
    assert_within_limits(robot)


def test_a_robot_that_is_pushed_is_not_told_to_go_along(monkeypatch):
    """Its servos hold against the push as long as the command stays what it was."""
    robot = Robot(MPC)
    for _ in range(10):
        robot.update(AHEAD(robot.time))
    before = robot.v.copy()
    robot.v = before + np.eye(9)[1] * 0.5
    monkeypatch.setattr(MPC.solver, "solve", unsolved)
    command = robot.update(AHEAD(robot.time))
    np.testing.assert_allclose(command.velocity(0.0), before, atol=1e-9)
    assert np.abs(command.velocities[:, 1]).max() < 1e-9


def test_a_robot_that_cannot_follow_is_waited_for():
    """A command that ran away from a robot held fast would throw it; it comes back within the limits."""
    robot = Robot(MPC)
    for _ in range(10):
        robot.update(AHEAD(robot.time))
    place, sent = robot.q.copy(), [robot.v[0]]
    assert sent[0] > 0.2
    for _ in range(20):
        held = State(place, np.zeros(9), robot.time, robot.sent)
        robot.update(AHEAD(robot.time), held)
        sent.append(robot.sent[0])
    stage = LIMITS.acceleration[0] * MPC.settings.dt
    assert sent[-1] < 0.1 * LIMITS.velocity[0] + stage + 1e-3  # as far as is trusted, and one stage
    assert_within_limits(robot)


def test_a_robot_knows_better_what_it_was_sent():
    """What was asked for may have been cut on the way; the next command goes on from what was sent."""
    for build in (MaskedMpc, CbfFilter, DirectController):
        controller = build(MODEL)
        controller.reset()
        controller.update(State(HOME, np.zeros(9), 0.0), AHEAD(0.0))
        sent = 0.3 * LIMITS.velocity
        command = controller.update(State(HOME, np.zeros(9), PERIOD, sent), AHEAD(PERIOD))
        np.testing.assert_allclose(command.velocity(0.0), sent)
        steps = np.abs(np.diff(command.velocities, axis=0))
        assert np.all(steps <= LIMITS.acceleration * command.dt + 1e-9)
        np.testing.assert_array_equal(command.velocities[-1], 0.0)  # and ends at rest


@pytest.mark.parametrize("late", [0.3, 1.05, 1.5, 3.0])
def test_a_late_update_goes_on_from_what_is_commanded(late):
    """A command brakes at its end; after that the robot is sent nothing, whatever it does."""
    MPC.reset()
    first = MPC.update(State(HOME, np.zeros(9), 0.0), AHEAD(0.0))
    moving = 0.4 * np.eye(9)[0]
    command = MPC.update(State(HOME, moving, late, first.velocity(late)), AHEAD(late))
    np.testing.assert_allclose(command.velocity(0.0), first.velocity(late), atol=1e-12)
    assert late < 2.0 or not first.velocity(late).any()


def test_a_command_goes_on_between_rest_and_what_was_commanded():
    """Cases a coordinate: followed, faster, pushed back, held fast, pushed from rest."""
    commanded = np.array([0.5, 0.5, 0.5, 0.5, 0.0])
    measured = np.array([0.45, 0.9, -0.3, 0.0, 0.7])
    expected = np.array([0.5, 0.5, 0.0, 0.1, 0.0])
    tolerance = np.full(5, 0.1)
    np.testing.assert_allclose(resumed(commanded, measured, tolerance), expected)
    np.testing.assert_allclose(resumed(-commanded, -measured, tolerance), -expected)


@settings(max_examples=30, deadline=None)
@given(arrays(float, 18, elements=st.floats(-3, 3)), arrays(float, 9, elements=st.floats(-1, 1)))
def test_a_plan_obeys_the_dynamics_and_the_limits(values, velocity):
    MPC.reset()
    state = State(HOME, velocity * LIMITS.velocity)
    problem = MPC.build_problem(state, Intent(values, CHANNELS.mask("joint")))
    plan = HONEST(problem, np.zeros((10, 9)))
    assert is_solution(plan, problem)
    assert np.all(np.abs(plan.v) <= LIMITS.velocity + 1e-9)


def test_a_solver_that_ignores_the_range_of_a_joint_is_stopped_in_it(monkeypatch):
    """The last wrist joint turns towards its end; nothing else keeps it from running into it."""
    monkeypatch.setattr(MPC.solver, "solve", reckless(joint=8))
    q = np.array(HOME)
    q[8] = LIMITS.position_upper[8] - 1.5
    robot = Robot(MPC, q=q)
    for _ in range(60):
        robot.update(AHEAD(robot.time))
    assert robot.commands[-1].diagnostics.status is Status.BACKUP
    assert abs(robot.q[8] - LIMITS.position_upper[8]) < 0.1
    assert robot.q[8] < LIMITS.position_upper[8] + 0.02


def test_where_nothing_is_safe_the_least_bad_is_done(monkeypatch):
    """A wall is put so close that no stop is short enough: the robot stops as fast as it can all the same."""
    wall = Obstacle("wall", Shape("box", [0.2, 4.0, 0.2]), [2.0, 0.0, 0.1])
    robot = Robot(MPC, (wall,))
    for _ in range(30):
        robot.update(AHEAD(robot.time))
    monkeypatch.setattr(MPC.solver, "solve", reckless(joint=0))
    robot.put(replace(wall, position=[robot.q[0] + 0.48 + 0.1 + 0.1, 0.0, 0.1]))
    for _ in range(5):
        before = robot.v[0]
        assert before > LIMITS.acceleration[0] * PERIOD
        assert robot.update(AHEAD(robot.time)).diagnostics.status is Status.BACKUP
        assert robot.v[0] == pytest.approx(before - LIMITS.acceleration[0] * PERIOD, abs=1e-9)


def test_a_solver_that_ignores_a_wall_is_stopped_before_it(monkeypatch):
    monkeypatch.setattr(MPC.solver, "solve", reckless(joint=0))
    robot = Robot(MPC, (Obstacle("wall", Shape("box", [0.2, 4.0, 0.2]), [HOME[0] + 0.83, 0.0, 0.1]),))
    for _ in range(60):
        robot.update(AHEAD(robot.time))
    assert Status.BACKUP in {command.diagnostics.status for command in robot.commands}
    assert robot.smallest > 0.02

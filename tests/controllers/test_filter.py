"""The safety filters' laws: what is feasible passes, what is not is changed least, nothing is touched."""

from dataclasses import replace

import numpy as np
import pytest
from collect_helpers import environment
from ideal_robot import CHANNELS, HOME, LIMITS, MODEL, PERIOD, Robot, roll, without_shapes

from handrail.collect.world.scene import Scene
from handrail.collect.world.task import Start
from handrail.collect.world.tasks.furniture import pillar
from handrail.controllers.baselines.cbf_filter import ALPHA, MARGIN, CbfFilter
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.collision.slacks import LIMITS as DISTANCES
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.safety_filter import safety_filter
from handrail.controllers.numerics.threads import single_threaded
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.controllers.solvers.converged import ConvergedSolver

ALONE = without_shapes(MODEL.description)
JOINTS = CHANNELS.joint_slice
FILTERS = (safety_filter, CbfFilter)
POST = Obstacle("post", Shape("cylinder", [0.2, 0.4]), [-0.3, 0.0, 0.2])
AHEAD = np.array([1.0, 0, 0, 0, 0, 0, 0, 0, 1.0])  # drive on, and turn a wrist that has nothing to do with it


def asked(velocities, time=0.0):
    values = np.append(np.zeros(CHANNELS.size - len(HOME)), velocities)
    return Intent(values, np.arange(len(values)) >= CHANNELS.size - len(HOME), time=time)


def follow(controller, velocities, q=HOME):
    """Ask for joint velocities in turn; return positions (T + 1, n), what was sent (T, n), and commands."""
    asks = [lambda time, wanted=wanted: asked(wanted, time) for wanted in velocities]
    path, sent, commands = roll(controller, asks, q)
    return path, sent[1:], commands


def feasible(rng, steps=60):
    """Return velocities that the accelerations allow and that stay clear of the position limits, (T, n)."""
    times = PERIOD * np.arange(1, steps + 1)[:, None]
    rate = rng.uniform(2.5, 6.0, 9)
    amplitude = np.minimum(0.9 * LIMITS.acceleration / rate, 0.9 * LIMITS.velocity)
    return amplitude * np.sin(rate * times)


@pytest.mark.parametrize("make", FILTERS)
@pytest.mark.parametrize("seed", range(3))
def test_a_feasible_command_passes(make, seed):
    velocities = feasible(np.random.default_rng(seed))
    _, sent, commands = follow(make(ALONE, PERIOD), velocities)
    assert np.abs((sent - velocities) / LIMITS.velocity).max() < 1e-3
    assert {command.diagnostics.status for command in commands} == {Status.OK}


@pytest.mark.parametrize("make", FILTERS)
def test_in_free_space_the_smallest_correction_is_the_clip(make):
    """Full stick to and fro: what the limits of velocity and acceleration cut is all that is cut."""
    rng = np.random.default_rng(3)
    velocities = np.repeat(LIMITS.velocity * rng.choice([-1.5, 0.0, 1.0], (6, 9)), 5, axis=0)
    _, sent, _ = follow(make(ALONE, PERIOD), velocities)
    _, clipped, _ = follow(DirectController(ALONE, PERIOD), velocities)
    assert np.abs((sent - clipped) / LIMITS.velocity).max() < 1e-3


ROUND = load_model("lekiwi")  # turning brings its base no nearer to a wall
WALL = Obstacle("wall", Shape("box", [0.2, 4.0, 0.08]), [1.0, 0.0, 0.04])
FORWARD = np.array([1.0, 0, 0, 0, 0, 0, 0, 1.0])  # drive on, and turn a jaw that has nothing to do with it


def straight_at(model, x):
    """Return the robot's position at home, its base at x."""
    return np.concatenate([[x, 0.0, 0.0], model.description.home[3:]])


def test_the_correction_is_the_smallest():
    """Close to a wall, full speed ahead: no plan that keeps the limits deviates less, says IPOPT."""
    mpc = safety_filter(ROUND, PERIOD)
    mpc.reset((WALL,))
    speed = FORWARD * ROUND.description.limits.velocity[0]
    path, sent, _ = follow(mpc, [speed] * 14, straight_at(ROUND, 0.645))
    state, intent = State(path[-1], sent[-1], 14 * PERIOD), asked(speed, 14 * PERIOD)
    problem = mpc.build_problem(state, intent)
    velocity = mpc.update(state, intent).velocity(PERIOD)
    solver = ConvergedSolver(mpc.residuals, problem.horizon, ROUND.size, problem.dt)
    found = solver.evaluate(problem, mpc.plan.u)
    best = solver.evaluate(problem, solver.solve(problem, mpc.plan.u).u)
    assert velocity[0] < 0.9 * speed[0]  # it does correct
    assert found.slack[:DISTANCES].max() < 1e-3
    assert found.tracking < 1.01 * best.tracking


@pytest.mark.parametrize("make", FILTERS)
def test_a_joint_that_threatens_nothing_is_left_alone(make):
    controller, last = make(ROUND, PERIOD), len(FORWARD) - 1
    controller.reset((WALL,))
    speed = FORWARD * ROUND.description.limits.velocity
    speed[last] = 0.1
    path, sent, _ = follow(controller, [speed] * 200, straight_at(ROUND, 0.5))
    np.testing.assert_allclose(sent[5:, last], speed[last], atol=0.02)
    assert np.abs(sent[-1, :3]).max() < 0.02  # the base stands
    collision, margin = CollisionModel(ROUND, (WALL,)), MARGIN * ROUND.description.world.scale
    left = collision.values(path)[:, collision.pairs.index(("chassis", "wall"))]
    assert 0.95 * margin < left.min() < (1.05 if make is safety_filter else 1.3) * margin  # by barriers


@pytest.mark.parametrize(
    ("make", "touches"), [(safety_filter, False), (CbfFilter, False), (DirectController, True)]
)
def test_nothing_is_touched_in_physics(make, touches):
    """Every joint at full stick between pillars, in MuJoCo: the filters go near and touch nothing."""
    contacts, moved = 0, 0.0
    with environment("Reach") as env, single_threaded():
        env.reset(seed=0)
        around = [pillar(f"p{k}", -1.5 + 1.3 * np.cos(k), 1.3 * np.sin(k), 0.15, 1.2) for k in range(1, 6)]
        env.reset(options={"start": Start(Scene(tuple(around)), HOME)})
        controller = make(MODEL, PERIOD)
        controller.reset(env.obstacles())
        rng = np.random.default_rng(1)
        for step in range(100):
            if step % 20 == 0:
                wanted = LIMITS.velocity * rng.choice([-1.0, 1.0], 9)
            state = env.state()
            velocity = controller.update(state, asked(wanted, state.time)).velocity(PERIOD)
            contacts += env.step(np.append(velocity, 0.0).astype(np.float32))[4]["contacts"]
            moved += PERIOD * np.abs(velocity / LIMITS.velocity).mean()
    assert (contacts > 0) == touches
    assert moved > 1.0  # of 5 s: the filter does not just stand there


def barriers(q):
    """Return how far all pairs are beyond their margins, (P,), and the gradients, (P, n)."""
    collision = CollisionModel(MODEL, (POST,))
    found = collision.distances(q[None])
    assert len(found.near) == collision.size
    return found.values[0] - np.minimum(MARGIN, collision.largest_margin), found.gradients


def test_the_cbf_filter_projects_onto_the_barriers():
    """Optimal for a convex QP: (u* - u_cmd)ᵀ W (u - u*) ≥ 0 for every allowed u; and u* is allowed."""
    rng = np.random.default_rng(0)
    weights, corrected = LIMITS.velocity**-2.0, 0
    for _ in range(20):
        q = np.array(HOME)
        q[0] += rng.uniform(0.0, 0.35)
        v, wanted = (rng.uniform(-1, 1, 9) * share * LIMITS.velocity for share in (0.05, 0.3))
        controller = CbfFilter(MODEL, PERIOD)
        controller.reset((POST,))
        command = controller.update(State(q, v), asked(wanted))
        u = command.velocity(PERIOD)
        left, gradients = barriers(q)
        assert np.all(gradients @ u >= -ALPHA * left - command.diagnostics.slack - 1e-5)
        corrected += np.abs(u - wanted).max() > 1e-3
        step = LIMITS.acceleration * PERIOD
        others = np.clip(v + rng.uniform(-1, 1, (3000, 9)) * step, -LIMITS.velocity, LIMITS.velocity)
        allowed = others[np.all(others @ gradients.T >= -ALPHA * left, axis=1)]
        assert command.diagnostics.slack > 1e-6 or np.all((allowed - u) @ (weights * (u - wanted)) >= -1e-6)
    assert corrected > 10


def test_the_cbf_filter_says_when_the_acceleration_is_not_enough():
    """It looks one step ahead: too fast and too near, it can only brake, and reports the slack."""
    controller = CbfFilter(MODEL, PERIOD)
    near = np.array(HOME)
    near[0] = POST.position[0] - 0.2 - 0.48 - 0.15
    controller.reset((POST,))
    command = controller.update(State(near, np.eye(9)[0]), asked(AHEAD))
    assert command.diagnostics.status is Status.OK
    assert command.diagnostics.slack > 0.1
    np.testing.assert_allclose(command.velocity(PERIOD)[0], 1.0 - LIMITS.acceleration[0] * PERIOD, atol=1e-6)


def test_the_cbf_filter_gives_way_to_what_comes():
    robot = Robot(CbfFilter(MODEL, PERIOD), (replace(POST, velocity=[-0.3, 0.0, 0.0]),))
    for _ in range(80):
        robot.update(asked(np.zeros(9), robot.time))
    assert robot.q[0] < HOME[0] - 0.2
    assert robot.smallest > 0.05


def test_a_failed_qp_brakes(monkeypatch):
    from handrail.controllers.baselines import cbf_filter

    controller = CbfFilter(MODEL, PERIOD)
    _, sent, _ = follow(controller, [0.3 * AHEAD] * 5)
    monkeypatch.setattr(cbf_filter.daqp, "solve", lambda *_: (np.zeros(10), 0.0, -1, {}))
    command = controller.update(State(HOME, sent[-1], 0.25), asked(AHEAD, 0.25))
    assert command.diagnostics.status is Status.SOLVER_FAILED
    slower = np.maximum(np.abs(sent[-1]) - LIMITS.acceleration * PERIOD, 0.0)
    np.testing.assert_allclose(np.abs(command.velocity(PERIOD)), slower, atol=1e-9)

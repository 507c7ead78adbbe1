"""Laws of every robot in a world, MuJoCo's and the ideal one: limits, one memory of what was sent, rest."""

import numpy as np
import pytest

from handrail.collect.world.ideal_robot import IdealRobot
from handrail.collect.world.scene import Patrol, Scene, SceneObject
from handrail.collect.world.simulation import Simulation
from handrail.collect.world.tasks.furniture import pillar
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Shape

MODEL = load_model()
HOME, LIMITS, STEP = MODEL.description.home, MODEL.description.limits, 0.05
AHEAD = np.append([0.3], np.zeros(MODEL.size))


@pytest.fixture(params=[Simulation, IdealRobot])
def build(request):
    return lambda *things, **options: request.param(MODEL, Scene(things), HOME, STEP, **options)


def test_every_sent_command_is_inside_the_limits_and_known(build):
    rng, robot = np.random.default_rng(0), build()
    before = robot.state().commanded
    assert not before.any()
    for index in range(80):
        command = rng.normal(scale=5.0, size=MODEL.size + 1)
        if index % 7 == 0:
            command[rng.integers(len(command))] = [np.nan, np.inf, -np.inf][index % 3]
        sent = robot.send(command[: 4 if index % 11 == 0 else None])
        state = robot.state()
        np.testing.assert_array_equal(state.commanded, sent[:-1])
        assert 0.0 <= sent[-1] <= 1.0
        assert np.all(np.abs(state.commanded) <= LIMITS.velocity * (1.0 + 1e-6))
        steps = np.abs(state.commanded - before)
        assert np.all(steps <= LIMITS.acceleration * STEP * (1.0 + 1e-5))
        assert state.time == pytest.approx((index + 1) * STEP)
        before = state.commanded


def test_a_stop_ends_at_rest_within_the_limits(build):
    robot = build()
    for _ in range(20):
        robot.send(AHEAD + [*np.zeros(MODEL.size), 1.0])
    moving, since = robot.state().commanded, robot.state().time
    robot.stop()
    state = robot.state()
    assert moving.any()
    assert not state.commanded.any()
    assert state.time - since >= np.max(np.abs(moving) / LIMITS.acceleration) - STEP
    assert robot.send(())[-1] == 1.0  # the gripper stays as it is


def test_both_move_alike():
    robot, ideal = (kind(MODEL, Scene(), HOME, STEP) for kind in (Simulation, IdealRobot))
    for k in range(40):
        for each in (robot, ideal):
            each.send(AHEAD * np.sin(0.1 * k))
    np.testing.assert_allclose(robot.state().q, ideal.state().q, atol=5e-3)
    np.testing.assert_allclose(robot.tools[0].position, ideal.tools[0].position, atol=1e-2)


def test_running_into_something_is_a_contact(build):
    robot = build(pillar("post", HOME[0] + 1.0, HOME[1], 0.1, 0.3))
    assert robot.contacts == ()
    touched = set()
    for _ in range(60):
        robot.send(AHEAD)
        touched |= {part for pair in robot.contacts for part in pair.split(" – ")}
    assert "post" in touched


def test_a_moving_obstacle_is_where_its_patrol_says(build):
    start, end = np.array([3.0, 3.0, 0.5]), np.array([3.0, 4.0, 0.5])
    mover = SceneObject("cart", Shape("box", [0.2, 0.2, 0.2]), start, patrol=Patrol(start, end, 0.5))
    robot = build(mover)
    for _ in range(10):
        robot.send(np.zeros(MODEL.size + 1))
    np.testing.assert_allclose(robot.obstacles()[0].position, mover.patrol.position(0.5), atol=1e-9)
    np.testing.assert_allclose(robot.poses()["cart"].position, mover.patrol.position(0.5), atol=1e-3)


def test_movable_objects_are_refused_without_physics():
    cube = SceneObject("cube", Shape("box", [0.05, 0.05, 0.05]), np.array([2.0, 2.0, 0.5]), mass=0.1)
    with pytest.raises(HandrailError, match="nothing can be moved, got cube"):
        IdealRobot(MODEL, Scene((cube,)), HOME, STEP)

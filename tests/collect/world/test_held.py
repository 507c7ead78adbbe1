"""What the hand holds moves with the hand, and keeps from the robot and from what stands around."""

from dataclasses import replace

import numpy as np
import pytest
from ideal_robot import CHANNELS, HOME, LIMITS, MODEL, PERIOD, Robot, intent

from handrail.controllers.baselines.cbf_filter import CbfFilter
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.command import Status
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.shape import Obstacle, Shape

MPC = MaskedMpc(MODEL)
TURN = matrix_from_rpy([0.3, -0.2, 0.5])
BOX = Obstacle("box", Shape("box", [0.4, 0.3, 0.4]), [0.02, 0.05, 0.1], TURN, frame="tool")
POST = Obstacle("post", Shape("cylinder", [0.2, 1.2]), [0.4, 0.8, 0.6])
TABLE = Obstacle("table", Shape("box", [0.6, 0.8, 0.6]), [1.5, 0.0, 0.3], work_surface=True)


def held_rows(collision):
    return [index for index, pair in enumerate(collision.pairs) if "box" in pair]


def test_a_held_thing_keeps_from_robot_and_obstacles_but_may_be_put_down():
    with_it, without = CollisionModel(MODEL, (POST, TABLE, BOX)), CollisionModel(MODEL, (POST, TABLE))
    assert with_it.pairs[: without.size] == without.pairs
    added = with_it.pairs[without.size :]
    partners = {a for a, b in MODEL.description.self_pairs if b == "fingers"}
    assert {a for a, b in added if b == "box"} == partners
    assert [b for a, b in added if a == "box"] == ["post"]  # neither table nor floor
    assert not with_it.work[without.size :].any()


def test_a_held_thing_is_where_the_hand_takes_it():
    """Its distance is that of an obstacle standing where it is now."""
    rng = np.random.default_rng(0)
    collision = CollisionModel(MODEL, (POST, BOX))
    rows = [row for row in held_rows(collision) if collision.pairs[row][1] == "box"]
    for q in rng.uniform(-1.5, 1.5, (10, MODEL.size)):
        tool = MODEL.pose(q)
        there = tool.position + tool.rotation @ BOX.position
        standing = CollisionModel(MODEL, (Obstacle("box", BOX.shape, there, tool.rotation @ TURN),))
        for row in rows:
            if collision.pairs[row] in standing.pairs:  # the shoulder cannot meet the scene's obstacles
                other = standing.values(q[None])[0, standing.pairs.index(collision.pairs[row])]
                assert collision.values(q[None])[0, row] == pytest.approx(other, abs=1e-5)


def test_a_held_object_comes_no_nearer_because_others_come():
    """What it keeps once it keeps on; to what came while it was held, what there was then."""
    other = replace(POST, name="other")
    first = CollisionModel(MODEL, (POST, BOX))
    around = Surroundings.of(first, 0.1, 0.008).seen(np.full(first.size, 1.0)).among((POST, other, BOX))
    assert around.unknown
    second = around.collision
    margins = around.seen(np.full(second.size, 0.02)).margins
    for row in held_rows(second):
        assert margins[row] == (0.02 if "other" in second.pairs[row] else 0.1)


def test_things_come_and_go_and_change():
    collision = CollisionModel(MODEL, (POST,))
    assert collision.among((POST,)) is collision
    holding = collision.among((POST, BOX))
    assert len(held_rows(holding)) > 0
    assert holding.among((POST, BOX)) is holding
    assert not held_rows(holding.among((POST,)))
    larger = replace(POST, shape=Shape(POST.shape.kind, 2.0 * POST.shape.size))
    for others in ((TABLE,), (TABLE, BOX), (), (BOX,), (larger,), (replace(POST, work_surface=True),)):
        now, fresh = collision.among(others), CollisionModel(MODEL, others)
        assert now.pairs == fresh.pairs
        np.testing.assert_array_equal(now.values(HOME[None]), fresh.values(HOME[None]))
    with pytest.raises(HandrailError, match="frame 'nowhere'"):
        collision.among((POST, Obstacle("box", BOX.shape, BOX.position, frame="nowhere")))


def towards_the_base(held):
    """Ask the hand to come to the base at rest; return the box's least distance from the robot on the way."""
    robot, truth, smallest = Robot(MPC), CollisionModel(MODEL, (BOX,)), np.inf
    robot.put(*((BOX,) if held else ()))
    goal = MODEL.pose(HOME, "planar_base").position + [0.2, 0.0, 1.0]
    for _ in range(160):
        direction, values = goal - MODEL.pose(robot.q).position, np.zeros(CHANNELS.size)
        values[CHANNELS.hand_slice()][:3] = 0.3 * direction / max(np.linalg.norm(direction), 0.1)
        robot.update(intent(values, "base", "ee", time=robot.time))
        smallest = min(smallest, truth.values(robot.q[None])[0, held_rows(truth)].min())
    return smallest, {command.diagnostics.status for command in robot.commands}


def test_the_mpc_keeps_what_the_hand_holds_from_the_robot():
    ignorant, _ = towards_the_base(held=False)
    kept, statuses = towards_the_base(held=True)
    assert ignorant < 0.0  # it would run into itself
    assert kept > MPC.settings.margin - 5e-3
    assert statuses == {Status.OK}


@pytest.mark.parametrize(("build", "group"), [(MaskedMpc, "ee"), (MaskedMpc, "joint"), (CbfFilter, "joint")])
def test_a_grasp_beside_an_obstacle_moves_nothing_and_the_thing_may_come_away(build, group):
    """A rod is grasped, its end 5 mm from a wall: it stays, and taken away does not come so near again."""
    tool, length = MODEL.pose(HOME), 0.6
    rod = Obstacle("rod", Shape("box", [0.05, 0.05, length]), [0.0, 0.0, length / 2], frame="tool")
    ahead = tool.rotation[:, 2]
    wall = Obstacle("wall", Shape("box", [0.02] * 3), tool.position + (length + 0.015) * ahead, tool.rotation)
    truth = CollisionModel(MODEL, (wall, rod))
    row, gaps, hand = truth.pairs.index(("rod", "wall")), [], []
    robot = Robot(build(MODEL), (wall,))
    robot.put(wall, rod)
    for k in range(160):
        rate = 0.0 if k < 40 else -0.05 if k < 100 else 0.05  # rest, away, back
        twist, values = np.append(rate * ahead, np.zeros(3)), np.zeros(CHANNELS.size)
        values[CHANNELS.hand_slice()] = twist
        values[CHANNELS.joint_slice] = np.linalg.pinv(MODEL.jacobian(robot.q)) @ twist
        robot.update(intent(values, group, time=robot.time))
        gaps.append(truth.values(robot.q[None])[0, row])
        hand.append(MODEL.pose(robot.q).position)
    assert np.linalg.norm(hand[39] - tool.position) < 2e-3
    assert gaps[39] == pytest.approx(0.005, abs=2e-3)
    assert gaps[99] > 0.1
    assert min(gaps[120:]) > 0.09


@pytest.mark.parametrize("build", [MaskedMpc, CbfFilter, DirectController])
def test_a_grasp_on_the_way_does_not_jerk_the_robot(build):
    robot, values = Robot(build(MODEL), (POST,)), np.zeros(CHANNELS.size)
    values[CHANNELS.joint_slice] = 0.2 * np.sin(np.arange(MODEL.size))
    for k in range(30):
        robot.put(*((POST, BOX) if 10 <= k < 20 else (POST,)))
        command = robot.update(intent(values, "joint", time=robot.time))
        assert not command.diagnostics.status.brakes
    assert np.all(np.abs(robot.steps) <= LIMITS.acceleration * PERIOD * (1 + 1e-6) + 1e-9)


def test_a_thing_that_has_slipped_is_where_it_is_now():
    before, now = (Obstacle("box", BOX.shape, [0.0, 0.0, z], TURN, frame="tool") for z in (0.1, 0.2))
    collision = CollisionModel(MODEL, (POST, before))
    assert collision.among((POST, now)) is collision
    path = np.random.default_rng(2).uniform(-1.5, 1.5, (20, MODEL.size))
    fresh = CollisionModel(MODEL, (POST, now)).values(path)
    np.testing.assert_allclose(collision.values(path), fresh, atol=1e-6)


def test_bounds_hold_for_a_thing_that_has_slipped():
    """A thing that sits otherwise in the hand than when it was grasped may reach farther from some joints."""
    rng, cube = np.random.default_rng(3), Shape("box", [0.05, 0.05, 0.05])
    collision = CollisionModel(MODEL, (POST, Obstacle("box", cube, [0.0, 0.0, 0.0], frame="tool")))
    collision.update_scene((POST, Obstacle("box", cube, [0.0, 0.0, 0.6], frame="tool")))
    for _ in range(60):
        q = rng.uniform(-1.5, 1.5, MODEL.size)
        path = q + np.outer(np.linspace(0.0, 0.4, 30), np.eye(MODEL.size)[rng.integers(6, 8)])  # a wrist
        exact = collision.values(path)
        cheap = collision.values(path, None, (path[0], exact[0]), np.full(collision.size, -1.0))
        assert np.all(cheap <= exact + 1e-5)

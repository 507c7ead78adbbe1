"""What the hand holds moves with the hand, and keeps from the robot and from what stands around."""

import numpy as np
import pytest
from collect_helpers import action, environment, over_cube

from handrail.collect.build import build_env, build_session
from handrail.collect.config import SessionConfig
from handrail.collect.geometry import box_around
from handrail.collect.tasks.task import Episode
from handrail.controllers.cbf_filter import CbfFilter
from handrail.controllers.collision import CollisionModel
from handrail.controllers.command import Status
from handrail.controllers.controller import State
from handrail.controllers.direct import DirectController
from handrail.controllers.errors import HandrailError
from handrail.controllers.intent import Intent
from handrail.controllers.model import load_model
from handrail.controllers.mpc import MaskedMpc
from handrail.controllers.rotation import matrix_from_rpy
from handrail.controllers.shape import Obstacle, Shape

MODEL = load_model()
HOME = MODEL.description.home
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


def test_gradients_and_bounds_of_held_things():
    rng, h = np.random.default_rng(1), 1e-3
    collision = CollisionModel(MODEL, (POST, BOX))
    rows, errors = held_rows(collision), []
    for _ in range(30):
        q = rng.uniform(-1.5, 1.5, MODEL.size)
        distances = collision.distances(q[None])
        steps = h * np.eye(MODEL.size)
        slopes = ((collision.values(q + steps) - collision.values(q - steps)) / (2 * h)).T
        apart = [row for row in rows if distances.values[0, row] > 0.02]
        errors += np.abs(distances.gradients - slopes)[apart].max(axis=1).tolist()
        path = q + np.cumsum(rng.uniform(-0.05, 0.05, (30, MODEL.size)), axis=0)
        exact = collision.values(path)
        assert np.all(collision.values(path, None, (path[0], exact[0])) <= exact + 1e-5)
    assert len(errors) > 100
    assert np.median(errors) < 1e-3
    assert np.quantile(errors, 0.98) < 2e-2


def test_what_is_held_comes_and_goes_but_the_rest_stays():
    collision = CollisionModel(MODEL, (POST,))
    assert collision.among((POST,)) is collision
    holding = collision.among((POST, BOX))
    assert len(held_rows(holding)) > 0
    assert holding.among((POST, BOX)) is holding
    assert not held_rows(holding.among((POST,)))
    for others in ((TABLE,), (TABLE, BOX), (), (BOX,)):
        with pytest.raises(HandrailError, match="obstacles: expected post"):
            collision.among(others)
    with pytest.raises(HandrailError, match="frame 'nowhere'"):
        collision.among((POST, Obstacle("box", BOX.shape, BOX.position, frame="nowhere")))


def towards_the_base(controller, held, seconds=8.0, period=0.05):
    """Ask the hand to come to the base at rest; return the box's least distance from the robot on the way."""
    truth, q, v = CollisionModel(MODEL, (BOX,)), np.array(HOME), np.zeros(MODEL.size)
    mask = controller.channels.mask("base", "ee")
    goal = MODEL.pose(q, "planar_base").position + [0.2, 0.0, 1.0]
    rows, smallest, statuses = held_rows(truth), np.inf, []
    for k in range(int(seconds / period)):
        controller.observe((BOX,) if held else ())
        direction = goal - MODEL.pose(q).position
        values = np.zeros(controller.channels.size)
        values[controller.channels.tool_slice][:3] = 0.3 * direction / max(np.linalg.norm(direction), 0.1)
        command = controller.update(State(q, v, k * period), Intent(values, mask, time=k * period))
        after = command.velocity(period)
        q, v = q + period * 0.5 * (v + after), after
        smallest = min(smallest, truth.values(q[None])[0, rows].min())
        statuses.append(command.health.status)
    return smallest, statuses


def test_the_mpc_keeps_what_the_hand_holds_from_the_robot():
    mpc = MaskedMpc(MODEL)
    mpc.reset()
    ignorant, _ = towards_the_base(mpc, held=False)
    mpc.reset()
    kept, statuses = towards_the_base(mpc, held=True)
    assert ignorant < 0.0  # it would run into itself
    assert kept > mpc.settings.margin - 5e-3
    assert set(statuses) == {Status.OK}


@pytest.mark.parametrize(("build", "group"), [(MaskedMpc, "ee"), (MaskedMpc, "joint"), (CbfFilter, "joint")])
def test_a_grasp_beside_an_obstacle_moves_nothing_and_the_thing_may_come_away(build, group):
    """A rod is grasped, its end 5 mm from a wall: the robot stays; taken away, it does not come back so near."""
    tool, length = MODEL.pose(HOME), 0.6
    rod = Obstacle("rod", Shape("box", [0.05, 0.05, length]), [0.0, 0.0, length / 2], frame="tool")
    ahead = tool.rotation[:, 2]
    wall = Obstacle("wall", Shape("box", [0.02] * 3), tool.position + (length + 0.015) * ahead, tool.rotation)
    truth = CollisionModel(MODEL, (wall, rod))
    row, period = truth.pairs.index(("rod", "wall")), 0.05
    controller = build(MODEL)
    controller.reset((wall,))
    q, v, gaps, hand = np.array(HOME), np.zeros(MODEL.size), [], []
    for k in range(160):
        controller.observe((wall, rod))
        rate = 0.0 if k < 40 else -0.05 if k < 100 else 0.05  # rest, away, back
        mask, values = controller.channels.mask(group), np.zeros(controller.channels.size)
        twist = np.append(rate * ahead, np.zeros(3))
        values[controller.channels.tool_slice] = twist if group == "ee" else 0.0
        joints = np.linalg.pinv(MODEL.jacobian(q)) @ twist
        values[controller.channels.joint_slice] = joints if group == "joint" else 0.0
        command = controller.update(State(q, v, k * period), Intent(values, mask, time=k * period))
        after = command.velocity(period)
        q, v = q + period * 0.5 * (v + after), after
        gaps.append(truth.values(q[None])[0, row])
        hand.append(MODEL.pose(q).position)
    assert np.linalg.norm(hand[39] - tool.position) < 2e-3
    assert gaps[39] == pytest.approx(0.005, abs=2e-3)
    assert gaps[99] > 0.1
    assert min(gaps[120:]) > 0.09


@pytest.mark.parametrize("build", [MaskedMpc, CbfFilter, DirectController])
def test_a_grasp_on_the_way_does_not_jerk_the_robot(build):
    controller = build(MODEL)
    controller.reset((POST,))
    channels, period, limits = controller.channels, 0.05, MODEL.description.limits
    values = np.zeros(channels.size)
    values[channels.joint_slice] = 0.2 * np.sin(np.arange(MODEL.size))
    mask = channels.mask("joint")
    q, v = np.array(HOME), np.zeros(MODEL.size)
    for k in range(30):
        controller.observe((POST, BOX) if 10 <= k < 20 else (POST,))
        command = controller.update(State(q, v, k * period), Intent(values, mask, time=k * period))
        after = command.velocity(period)
        assert np.all(np.abs(after - v) <= limits.acceleration * period * (1 + 1e-6) + 1e-9)
        assert not command.health.status.brakes
        q, v = q + period * 0.5 * (v + after), after


def test_the_fingers_hold_what_both_of_them_touch():
    with environment("PickPlace") as env:
        env.reset(options={"episode": over_cube(env, 3, 0.01)})
        assert env.simulation.held() == ()
        for _ in range(20):
            env.step(action(env, gripper=1.0))
        (cube,) = env.simulation.held()
        assert cube.name == "cube"
        assert [each.name for each in env.obstacles() if each.held] == ["cube"]
        assert np.linalg.norm(cube.position) < 0.03
        now, tool = env.task_state().pose("cube"), env.task_state().tool
        np.testing.assert_allclose(tool.position + tool.rotation @ cube.position, now.position, atol=1e-9)
        np.testing.assert_allclose(tool.rotation @ cube.rotation, now.rotation, atol=1e-9)
        for _ in range(20):
            env.step(action(env))
        assert env.simulation.held() == ()


def test_fingers_that_rest_on_a_thing_do_not_hold_it():
    with environment("PickPlace") as env:
        episode = over_cube(env, 3, 0.045)  # the finger tips 5 mm above the cube
        env.reset(options={"episode": Episode(episode.scene, episode.q, grip=0.0)})
        touched = False
        for _ in range(30):
            down = np.linalg.pinv(env.model.jacobian(env.state().q)) @ [0.0, 0.0, -0.01, 0.0, 0.0, 0.0]
            env.step(action(env, down, gripper=1.0))
            names = {
                env.simulation.mujoco_model.geom(int(geom)).name
                for geom in env.simulation.data.contact.geom.ravel()
            }
            touched = touched or {"cube", "finger_left", "finger_right"} <= names
            assert env.simulation.held() == ()
        assert touched


def test_a_held_tray_is_the_box_around_its_parts():
    with environment("Tray") as env:
        env.reset(seed=2)
        for _ in range(3):
            env.step(action(env, gripper=1.0))
        (tray,) = env.simulation.held()
        item, now, tool = env.episode.scene.find("tray"), env.task_state().pose("tray"), env.task_state().tool
        corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T * tray.shape.size
        box = tool.position + (tray.position + corners @ tray.rotation.T) @ tool.rotation.T
        local = (box - now.position) @ now.rotation
        for part in item.parts:
            half = np.array(part.shape.size) / 2
            assert np.all(part.position - half > local.min(axis=0) - 1e-9)
            assert np.all(part.position + half < local.max(axis=0) + 1e-9)
        np.testing.assert_allclose(np.ptp(local, axis=0), [0.26, 0.32, 0.225], atol=1e-9)


def test_a_drawer_is_held_by_its_rail_not_by_the_hand():
    with environment("Drawer") as env:
        env.reset(seed=0)
        assert not any(item.portable for item in env.episode.scene.movables)


class Watch:
    """Notes what a controller is told."""

    def __init__(self, inner):
        self.inner, self.told = inner, []

    def reset(self, obstacles=()):
        self.told.clear()
        self.inner.reset(obstacles)

    def observe(self, obstacles):
        self.told.append(tuple(obstacle.name for obstacle in obstacles if obstacle.held))
        self.inner.observe(obstacles)

    def update(self, state, intent):
        return self.inner.update(state, intent)


def test_a_session_tells_the_controller_what_is_held_until_it_is_let_go():
    config = SessionConfig(task="tray", mode="ee", noise=0.0)
    env = build_env(config, 20)
    try:
        session = build_session(config, env)
        session._controller = watch = Watch(session._controller)
        outcome = session.run(seed=1)
    finally:
        env.close()
    assert outcome.success
    assert outcome.contacts == 0
    assert watch.told[0] == ("tray",)
    assert watch.told[-1] == ()  # told once that nothing is held any more
    assert watch.told.count(()) < 5  # the fingers may lose it for a moment while they open
    assert len(watch.told) > 0.7 * outcome.frames


def test_the_box_around_shapes():
    quarter = matrix_from_rpy([0.0, 0.0, np.pi / 2])
    size, centre = box_around(
        [
            (Shape("box", [0.2, 0.1, 0.4]), np.array([0.0, 0.0, 0.2]), quarter),
            (Shape("sphere", [0.1]), np.array([0.3, 0.0, 0.0]), np.eye(3)),
        ]
    )
    np.testing.assert_allclose(size, [0.45, 0.2, 0.5], atol=1e-12)  # x from -0.05 to 0.4
    np.testing.assert_allclose(centre, [0.175, 0.0, 0.15], atol=1e-12)


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
    collision.observe((POST, Obstacle("box", cube, [0.0, 0.0, 0.6], frame="tool")))
    for _ in range(60):
        q = rng.uniform(-1.5, 1.5, MODEL.size)
        path = q + np.outer(np.linspace(0.0, 0.4, 30), np.eye(MODEL.size)[rng.integers(6, 8)])  # a wrist
        exact = collision.values(path)
        cheap = collision.values(path, None, (path[0], exact[0]), np.full(collision.size, -1.0))
        assert np.all(cheap <= exact + 1e-5)


class Closing:
    """Notes where the cube is from the tool when the gripper begins to close, an observer."""

    def begin(self, env, seed):
        self.env, self.offsets, self.turns = env, [], []
        self.closing = False

    def see(self, moment):
        state, closing = self.env.task_state(), moment.action[-1] > 0.5
        if closing and not self.closing:
            cube = state.pose("cube")
            self.offsets.append(state.tool.rotation.T @ (cube.position - state.tool.position))
        self.closing = closing


@pytest.mark.parametrize("mode", ["ee", "direct"])
def test_the_operator_closes_the_gripper_around_the_cube(mode):
    """The cube is between the fingers, with what the hand may be turned; their tips are beside it."""
    config = SessionConfig(task="pick_place", mode=mode)
    gripper, edge = MODEL.description.gripper, 0.05
    env, watch = build_env(config, 20), Closing()
    try:
        session = build_session(config, env, [watch])
        assert [session.run(seed).success for seed in (100, 101)] == [True, True]
    finally:
        env.close()
    tips = gripper.tip - 0.29  # beyond the tool point
    for across, _, along in watch.offsets:
        assert abs(across) < (gripper.stroke - edge) / 2
        assert tips - edge / 2 < along < tips + 0.01

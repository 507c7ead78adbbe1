"""The scripted operator's laws: a perfect hand is transparent, a human one is late, noisy and repeatable."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from device_helpers import first_view
from scipy.spatial.transform import Rotation

from handrail.collect.operators.devices.input_map import StickMap
from handrail.collect.operators.human.hand import HumanHand, minimum_jerk
from handrail.collect.operators.human.human import HumanSettings
from handrail.collect.operators.human.motion_goal import MotionGoal
from handrail.collect.operators.human.perception import Perception
from handrail.collect.operators.human.steering import Gains, base_twist, hand_twist
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.scripts.base_placement import (
    standing_point,
    standing_pose,
    standing_within_reach,
)
from handrail.collect.operators.scripts.drawer import handle_rotation
from handrail.collect.operators.scripts.pick_place import grasp_rotation
from handrail.collect.tasks.cabinet import HANDLE, inward
from handrail.collect.tasks.drawer import Drawer
from handrail.collect.tasks.reach import Reach
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.controller import State
from handrail.controllers.robot.inverse_kinematics import arm_configuration
from handrail.controllers.robot.model import Pose, load_model

MODEL = load_model()
STICKS = sorted(name for name, mode in MODES.items() if mode.device == "sticks")
HOME = MODEL.description.home
FULL = np.array([0.5, 0.5, 1.0])
PERIOD = 0.05


def signal(steps=200):
    times = PERIOD * np.arange(steps)
    return times, 0.4 * np.sin(np.outer(times, [1.0, 0.7, 0.3]))


def run(settings, wanted, times, seed=0):
    hand = HumanHand(settings, FULL, FULL, np.random.default_rng(seed))
    return np.array([hand.move(row, time) for row, time in zip(wanted, times, strict=True)])


def human(**numbers):
    return replace(HumanSettings.perfect(), **numbers)


def test_a_perfect_hand_is_transparent():
    times, wanted = signal()
    np.testing.assert_array_equal(run(HumanSettings.perfect(), wanted, times), wanted)
    np.testing.assert_array_equal(run(HumanSettings().scaled(0.0), wanted, times), wanted)


def test_delay_is_a_shift():
    times, wanted = signal()
    late = run(human(delay=0.2), wanted, times)
    np.testing.assert_allclose(late[4:], wanted[:-4])
    np.testing.assert_array_equal(late[:4], 0.0)


def test_corrections_are_intermittent():
    times, wanted = signal()
    held = run(human(refractory=0.35), wanted, times)
    moves = np.flatnonzero(np.any(np.diff(held, axis=0), axis=1))
    assert len(moves) > 10
    assert np.min(np.diff(times[moves])) >= 0.35 - 1e-9


def test_letting_go_is_immediate():
    times = PERIOD * np.arange(5)
    wanted = np.array([[0.3, 0, 0]] * 2 + [[0.0, 0, 0]] * 3)
    held = run(human(refractory=10.0), wanted, times)
    np.testing.assert_array_equal(held[2:], 0.0)


def test_noise_grows_with_the_signal_and_rests_at_rest():
    times = PERIOD * np.arange(4000)
    settings = human(noise=0.1, correlation=0.5)
    small = run(settings, np.tile([0.1, 0, 0], (4000, 1)), times)
    large = run(settings, np.tile([0.4, 0, 0], (4000, 1)), times)
    assert np.std(small[:, 0]) == pytest.approx(0.01, rel=0.2)
    assert np.std(large[:, 0]) == pytest.approx(0.04, rel=0.2)
    np.testing.assert_array_equal(small[:, 1:], 0.0)


def test_the_same_seed_is_the_same_hand():
    times, wanted = signal()
    first, again, other = (run(HumanSettings(), wanted, times, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_the_hand_never_leaves_the_stick():
    times, _ = signal()
    wanted = np.tile(FULL, (len(times), 1))
    moved = run(human(noise=1.0, drift=1.0, correlation=0.5), wanted, times)
    assert np.all(np.abs(moved) <= FULL)


@pytest.mark.parametrize("name", ["ridgeback_ur10", "ridgeback_panda", "lekiwi"])
def test_a_person_is_as_exact_at_the_tool_with_joints_as_with_the_hand(name):
    model, times = load_model(name), PERIOD * np.arange(4000)
    sticks = StickMap(model, MODES["direct"], Gains().within(model.description.world))
    tool, joints = sticks.channels.tool_slice, sticks.channels.joint_slice
    hand = HumanHand(human(drift=0.02, correlation=0.2), sticks.full, sticks.fine, np.random.default_rng(0))
    wanted = 1e-9 * sticks.full  # touched, and next to nothing
    moved = np.array([hand.move(wanted, time) for time in times])
    by_hand = moved[:, tool] / sticks.full[tool]
    by_joints = moved[:, joints] @ model.jacobian(model.description.home).T / sticks.full[tool]
    assert np.sqrt(np.mean(by_hand**2)) == pytest.approx(0.02, rel=0.1)
    assert np.sqrt(np.mean(by_joints**2)) == pytest.approx(0.02, rel=0.1)


def test_a_dead_zone_is_a_share_of_what_is_fine():
    full, fine = np.array([1.0]), np.array([0.4])
    hand = HumanHand(human(threshold=0.1, refractory=0.05), full, fine, np.random.default_rng(0))
    moved = [hand.move(np.array([wanted]), float(time))[0] for time, wanted in enumerate((0.5, 0.53, 0.55))]
    assert moved == [0.5, 0.5, 0.55]


@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
def test_wrong_settings_are_refused(value):
    with pytest.raises(HandrailError, match=r"--human\.noise: expected a finite number"):
        HumanSettings(noise=value)


def test_the_hand_moves_along_minimum_jerk():
    times = 0.01 * np.arange(100)
    moved = run(human(refractory=2.0, movement=0.5), np.tile([0.4, 0, 0], (100, 1)), times)
    np.testing.assert_allclose(moved[:, 0], [0.4 * minimum_jerk(time / 0.5) for time in times])
    shares = np.array([minimum_jerk(tau) for tau in np.linspace(0, 1, 1001)])
    assert np.max(np.diff(shares)) == pytest.approx(1.875e-3, rel=1e-3)  # peak speed 15/8 of the mean


def test_letting_go_needs_no_movement():
    times = 0.05 * np.arange(6)
    wanted = np.array([[0.3, 0, 0]] * 3 + [[0.0, 0, 0]] * 3)
    np.testing.assert_array_equal(run(human(refractory=1.0, movement=0.1), wanted, times)[3:], 0.0)


def test_steering_obeys_fitts_law():
    """Every halving of what is left takes as long as the last: throughput `gain / ln 2`."""
    gains, h = Gains(gain=1.5, hand_speed=10.0), 1e-3
    goal, places = np.array([0.4, 0.0, 0.0]), [np.zeros(3)]
    for _ in range(3000):
        twist = hand_twist(Pose(places[-1], np.eye(3)), Pose(goal, np.eye(3)), gains)
        places.append(places[-1] + h * twist[:3])
    left = np.linalg.norm(goal - places, axis=1)
    reached = [h * np.argmax(left < 0.4 / 2**bits) for bits in range(1, 5)]
    np.testing.assert_allclose(np.diff(reached), np.log(2) / 1.5, atol=2e-3)


def test_persons_differ_and_a_perfect_one_does_not():
    first, again, other = (HumanSettings().person(np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert first == again != other
    assert all(0.7 < a / b < 1.4 for a, b in zip(astuple(first), astuple(HumanSettings()), strict=True))
    assert HumanSettings.perfect().person(np.random.default_rng(1)) == HumanSettings.perfect()
    moods = first.episode(np.random.default_rng(3))
    assert moods != first
    assert (moods.persons, moods.moods) == (first.persons, first.moods)


def test_what_is_near_is_judged_well():
    """Weber's law: the misjudgement is in proportion to the distance, and rests where nothing is wanted."""
    errors = {}
    for length in (0.05, 0.5):
        perception = Perception(human(misjudgement=0.1), np.random.default_rng(0))
        wanted = MotionGoal(np.array([length, 0, 0, 0, 0, 0.0]), np.zeros(3))
        seen = np.array([perception.see(wanted, MODEL.pose(HOME), 0.0).hand for _ in range(3)])
        errors[length] = (seen - wanted.hand)[0, :3]
        assert np.all(seen[:, 3:] == 0.0)
    assert np.all(errors[0.5] != 0.0)
    np.testing.assert_allclose(errors[0.5], 10.0 * errors[0.05])


def state(q=HOME, time=0.0):
    return State(q, np.zeros(MODEL.size), time)


def sticks(mode):
    inputs = StickMap(MODEL, mode, Gains())
    inputs.reset(first_view(), HumanSettings.perfect(), np.random.default_rng(0))
    return inputs


def motion_goal(focus="hand"):
    return MotionGoal(np.array([0.1, -0.05, 0.1, 0.1, 0.0, -0.2]), np.array([0.2, 0.1, 0.1]), focus)


@pytest.mark.parametrize("name", STICKS)
@pytest.mark.parametrize("focus", ["hand", "base"])
def test_a_mode_speaks_only_on_its_channels(name, focus):
    inputs = sticks(MODES[name])
    mask, values = inputs.wanted(motion_goal(focus), state())
    np.testing.assert_array_equal(mask, inputs.mask(focus))
    assert np.any(values[mask])
    np.testing.assert_array_equal(values[~mask], 0.0)
    assert np.all(np.abs(values) <= inputs.full)


def test_switching_follows_the_focus():
    inputs = sticks(MODES["switching"])
    np.testing.assert_array_equal(inputs.mask("hand"), inputs.channels.mask("ee"))
    np.testing.assert_array_equal(inputs.mask("base"), inputs.channels.mask("base"))


def test_joint_inputs_move_the_hand_as_wished():
    inputs = sticks(MODES["direct"])
    velocities = inputs.wanted(motion_goal(), state())[1][inputs.channels.joint_slice]
    twist = MODEL.jacobian(HOME) @ velocities
    np.testing.assert_allclose(twist, motion_goal().hand, atol=0.02)


def test_neither_posture_nor_base_holds_the_hand_off_its_goal():
    inputs, rng = sticks(MODES["direct"]), np.random.default_rng(0)
    goal = MotionGoal(np.array([0.0, 0.0, 0.02, 0.0, 0.0, 0.0]), np.array([-0.1, 0.0, 0.0]))  # slowly up
    for _ in range(20):
        q = HOME + np.concatenate([np.zeros(3), rng.uniform(-0.6, 0.6, 6)])
        velocities = inputs.wanted(goal, replace(state(), q=q))[1][inputs.channels.joint_slice]
        np.testing.assert_allclose(MODEL.jacobian(q) @ velocities, goal.hand, atol=2e-3)


def test_steering_points_at_the_goal():
    rng = np.random.default_rng(0)
    for _ in range(20):
        goal = Pose(rng.uniform(-1, 1, 3), Rotation.random(rng=rng).as_matrix())
        tool = Pose(rng.uniform(-1, 1, 3), Rotation.random(rng=rng).as_matrix())
        twist = hand_twist(tool, goal, Gains())
        h = 1e-3
        nearer = Rotation.from_rotvec(h * twist[3:]).as_matrix() @ tool.rotation
        assert np.linalg.norm(goal.position - tool.position - h * twist[:3]) < np.linalg.norm(
            goal.position - tool.position
        )
        assert np.trace(goal.rotation @ nearer.T) > np.trace(goal.rotation @ tool.rotation.T)
    np.testing.assert_allclose(hand_twist(tool, tool, Gains()), 0.0, atol=1e-12)


def test_driving_is_in_the_base_frame():
    q = np.array(HOME)
    q[2] = np.pi / 2
    goal = np.array([q[0], q[1] + 5.0, np.pi / 2])  # straight ahead
    np.testing.assert_allclose(base_twist(q, goal, Gains()), [Gains().base_speed, 0, 0], atol=1e-12)


def test_the_base_stands_where_the_place_is_in_reach():
    place = np.array([0.5, 0.4, 0.7])
    spot = standing_point(MODEL, place)
    assert 0.8 < np.linalg.norm(place[:2] - spot[:2]) < 1.5


def test_the_arm_is_solved_for_and_the_base_stays():
    rng, arm = np.random.default_rng(0), slice(3, MODEL.size)
    for _ in range(10):
        there = HOME + np.concatenate([np.zeros(3), rng.uniform(-0.4, 0.4, MODEL.size - 3)])
        q, error = arm_configuration(MODEL, HOME, MODEL.pose(there))
        np.testing.assert_array_equal(q[:3], HOME[:3])
        assert error < 1e-4
        np.testing.assert_allclose(MODEL.pose(q).position, MODEL.pose(there).position, atol=1e-4)
        assert np.all(np.abs(q[arm]) <= MODEL.description.limits.position_upper[arm])
    far = Pose(np.array([5.0, 0.0, 1.0]), np.eye(3))
    assert arm_configuration(MODEL, HOME, far)[1] > 1.0


def test_the_base_stands_where_the_arm_keeps_clear_of_itself():
    collision, clear = CollisionModel(MODEL), 0
    for seed in range(12):
        goal = Reach().sample(MODEL, np.random.default_rng(seed)).goal
        stand = standing_pose(MODEL, HOME, goal)
        q, error = arm_configuration(MODEL, np.concatenate([stand, HOME[3:]]), goal)
        clear += error < 0.01 and np.min(collision.values(q[None, :])) >= 0.08
    assert clear >= 10


def test_grasps_point_down_and_are_square_to_the_cube():
    for yaw in np.linspace(-np.pi, np.pi, 17):
        cube = Rotation.from_euler("z", yaw).as_matrix()
        grasp = grasp_rotation(MODEL.pose(HOME).rotation, cube)
        np.testing.assert_allclose(grasp[:, 2], [0, 0, -1], atol=1e-12)
        assert np.linalg.det(grasp) == pytest.approx(1.0)
        across = cube.T @ grasp[:, 0]
        assert np.max(np.abs(across)) == pytest.approx(1.0)


@pytest.mark.parametrize("robot", ["ridgeback_panda", "ridgeback_ur10"])
def test_a_person_stands_where_the_arm_reaches_the_handle(robot):
    model, reached = load_model(robot), 0
    for seed in range(10):
        episode = Drawer().sample(model, np.random.default_rng(seed))
        body, bar = episode.scene.find("cabinet"), episode.scene.find("drawer")
        into = inward(body.rotation)
        goal = Pose(bar.position + bar.rotation @ HANDLE, handle_rotation(np.eye(3), into))
        stand = standing_within_reach(model, episode.q, goal, float(np.arctan2(into[1], into[0])))
        reached += arm_configuration(model, np.concatenate([stand, episode.q[3:]]), goal)[1] <= 0.05
    assert reached >= 8

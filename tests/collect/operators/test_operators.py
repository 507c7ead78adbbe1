"""The scripted operator's laws: what they see, how they steer, where they stand."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from device_helpers import PERFECT, first_view
from scipy.spatial.transform import Rotation

from handrail.collect.operators.modes import MODES
from handrail.collect.operators.scripted.hand import Perception
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.input_map import StickMap
from handrail.collect.operators.scripted.placement import (
    standing_pose,
    standing_within_reach,
)
from handrail.collect.operators.scripted.steering import (
    Gains,
    MotionGoal,
    Target,
    hand_errors,
    hand_twist,
)
from handrail.collect.world.tasks.drawer import HANDLE, Drawer, handle_rotation, inward
from handrail.collect.world.tasks.reach import Reach
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.controller import State
from handrail.controllers.registry import fitting
from handrail.controllers.robot.inverse_kinematics import arm_configuration
from handrail.controllers.robot.model import Pose, load_model

MODEL = load_model()
STICKS = sorted(name for name, mode in fitting(MODES, 1).items() if mode.device == "sticks")
HOME = MODEL.description.home


def human(**numbers):
    return replace(PERFECT, **numbers)


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
    assert PERFECT.person(np.random.default_rng(1)) == PERFECT
    moods = first.episode(np.random.default_rng(3))
    assert moods != first
    assert (moods.persons, moods.moods) == (first.persons, first.moods)


def test_near_distances_are_judged_well():
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


def test_operators_of_joints_err_as_those_of_the_hand():
    """The pose that is seen is as far off as the way that is seen; what is meant stays what it was."""
    tool, rng = MODEL.pose(HOME), np.random.default_rng(3)
    for _ in range(5):
        turn = Rotation.from_rotvec(rng.uniform(-0.8, 0.8, 3)).as_matrix()
        goal = Pose(tool.position + rng.uniform(-0.5, 0.5, 3), turn @ tool.rotation)
        wanted = MotionGoal(hand_errors(tool, goal), np.zeros(3), target=Target(goal, HOME[:3]))
        seen = Perception(human(misjudgement=0.1), rng).see(wanted, tool, 0.0)
        assert np.linalg.norm(seen.hand - wanted.hand) > 0.01
        np.testing.assert_allclose(hand_errors(tool, seen.target.hand), seen.hand, atol=1e-9)
        assert seen.target.identity == wanted.target.identity
        assert seen.target.meant == goal


def state(q=HOME, time=0.0):
    return State(q, np.zeros(MODEL.size), time)


def sticks(mode):
    inputs = StickMap(MODEL, mode, Gains())
    inputs.reset(first_view(), PERFECT, np.random.default_rng(0))
    return inputs


def motion_goal(focus="hand"):
    return MotionGoal(np.array([0.1, -0.05, 0.1, 0.1, 0.0, -0.2]), np.array([0.2, 0.1, 0.1]), focus)


@pytest.mark.parametrize("name", STICKS)
@pytest.mark.parametrize("focus", ["hand", "base"])
def test_a_mode_speaks_only_on_its_channels(name, focus):
    inputs = sticks(MODES[name])
    mask, values = inputs.wanted(motion_goal(focus), state())
    np.testing.assert_array_equal(mask, inputs.channels.mask(*MODES[name].owned(focus, MODEL.hand.name)))
    assert np.any(values[mask])
    np.testing.assert_array_equal(values[~mask], 0.0)
    assert np.all(np.abs(values) <= inputs.full)


def test_neither_posture_nor_base_holds_the_hand_off_its_goal():
    inputs, rng = sticks(MODES["direct"]), np.random.default_rng(0)
    goal = MotionGoal(np.array([0.0, 0.0, 0.02, 0.0, 0.0, 0.0]), np.array([-0.1, 0.0, 0.0]))  # slowly up
    for _ in range(20):
        q = HOME + np.concatenate([np.zeros(3), rng.uniform(-0.6, 0.6, 6)])
        velocities = inputs.wanted(goal, replace(state(), q=q))[1][inputs.channels.joint_slice]
        np.testing.assert_allclose(MODEL.jacobian(q) @ velocities, goal.hand, atol=2e-3)


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

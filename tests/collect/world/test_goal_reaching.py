"""The goal-reaching protocol: goals come from their distribution, the planner's twist leads to its poses."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handrail.collect.world.tasks.goal_reaching import STEP, StraightPlanner, pose_error, reached, sample_goal
from handrail.collect.world.tasks.reach import Reach, sample_goal_for
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import quaternion_from_matrix
from handrail.controllers.robot.inverse_kinematics import body_configuration
from handrail.controllers.robot.model import Pose, RobotModel, load_model

SEEDS = st.integers(0, 2**32 - 1)


def two_goals(seed: int) -> tuple[Pose, Pose]:
    rng = np.random.default_rng(seed)
    return sample_goal(rng), sample_goal(rng)


def test_goals_fill_their_range_and_nothing_else():
    rng = np.random.default_rng(0)
    goals = [sample_goal(rng) for _ in range(4000)]
    positions = np.array([goal.position for goal in goals])
    angles = np.array([np.linalg.norm(pin.log3(goal.rotation)) for goal in goals])
    assert np.all(np.abs(positions.min(axis=0) - [-1.0, -1.0, 0.7]) < 0.01)
    assert np.all(np.abs(positions.max(axis=0) - [1.0, 1.0, 1.0]) < 0.01)
    shares = np.quantile((positions - [-1.0, -1.0, 0.7]) / [2.0, 2.0, 0.3], [0.25, 0.5, 0.75], axis=0)
    np.testing.assert_allclose(shares, np.outer([0.25, 0.5, 0.75], np.ones(3)), atol=0.03)
    assert np.quantile(angles, [0.25, 0.5, 0.75]) == pytest.approx(np.pi * np.array([1, 2, 3]) / 4, abs=0.1)


@given(SEEDS)
def test_the_reach_task_draws_the_same_goals(seed):
    goal = sample_goal(np.random.default_rng(seed))
    episode = Reach().sample(load_model(), np.random.default_rng(seed))
    assert np.array_equal(episode.goal.position, goal.position)
    assert np.allclose(episode.goal.rotation, goal.rotation)


def test_goals_are_within_reach_of_a_stiff_wrist():
    limits, home = load_model().description.limits, load_model().description.home
    lower, upper = limits.position_lower.copy(), limits.position_upper.copy()
    lower[5:8], upper[5:8] = home[5:8] - 0.3, home[5:8] + 0.3
    narrow = replace(limits, position_lower=lower, position_upper=upper)
    model, rng = RobotModel(replace(load_model().description, limits=narrow)), np.random.default_rng(0)
    starts = [home, *(home + rng.uniform(-2.0, 2.0, home.shape) for _ in range(60))]

    def error(goal):
        return min(body_configuration(model, np.clip(q, lower, upper), goal)[1] for q in starts)

    assert max(error(sample_goal_for(model, rng)) for _ in range(30)) < 1e-2
    assert max(error(sample_goal(rng)) for _ in range(30)) > 0.1


@given(SEEDS)
def test_orientation_error_is_that_of_quaternions(seed):
    one, other = two_goals(seed)
    quaternions = [quaternion_from_matrix(goal.rotation) for goal in (one, other)]
    d_p, d_r = pose_error(one.position, one.rotation, other)
    assert d_p == pytest.approx(np.linalg.norm(one.position - other.position))
    assert d_r == pytest.approx(1.0 - np.dot(*quaternions) ** 2, abs=1e-9)
    assert pose_error(one.position, one.rotation, one) == (0.0, pytest.approx(0.0, abs=1e-12))


@pytest.mark.parametrize(
    ("d_p", "d_r", "success"), [(0.1, 0.05, True), (0.1001, 0, False), (0, 0.051, False)]
)
def test_success_needs_both(d_p, d_r, success):
    assert reached(d_p, d_r) is success


@given(SEEDS, st.sampled_from([1.0, 1.5, 2.0, 3.0]))
def test_the_twist_integrates_to_the_poses_and_ends_at_the_goal(seed, speed):
    start, goal = two_goals(seed)
    planner = StraightPlanner.plan(start.position, start.rotation, goal, speed=speed)
    position, rotation = start.position, start.rotation
    for t in range(planner.steps + 3):
        if t in (planner.steps // 3, planner.steps - 1, planner.steps, planner.steps + 2):
            planned = planner.pose(t)
            assert np.allclose(position, planned[0], atol=1e-9)
            assert np.allclose(rotation, planned[1], atol=1e-7)
        twist = planner.twist(t)
        position, rotation = position + STEP * twist[:3], pin.exp3(STEP * twist[3:]) @ rotation
    assert pose_error(position, rotation, goal) == (pytest.approx(0, abs=1e-9), pytest.approx(0, abs=1e-9))
    assert not planner.twist(planner.steps).any()


@pytest.mark.parametrize(("distance", "steps"), [(0.1, 300), (0.72, 300), (1.2, 500), (1.201, 501)])
def test_the_planner_is_as_fast_as_the_paper_s(distance, steps):
    goal = Pose(np.array([distance, 0.0, 0.0]), np.eye(3))
    planner = StraightPlanner.plan(np.zeros(3), np.eye(3), goal)
    assert planner.steps == steps
    assert StraightPlanner.plan(np.zeros(3), np.eye(3), goal, speed=2.0).steps == -(-steps // 2)


@pytest.mark.parametrize("options", [{"speed": 0.0}, {"speed": np.nan}, {"speed": -0.1}])
def test_a_planner_without_speed_is_refused(options):
    with pytest.raises(HandrailError, match="expected a positive number"):
        StraightPlanner.plan(np.zeros(3), np.eye(3), Pose(np.ones(3), np.eye(3)), **options)

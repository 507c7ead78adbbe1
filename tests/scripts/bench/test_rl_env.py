"""The environment of the reinforcement-learning baseline: Gymnasium's rules, the paper's, and physics'."""

import re

import numpy as np
import pinocchio as pin
import pytest
from collect_helpers import SMALL_ROBOT
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

import handrail.policies  # noqa: F401  (registers the environment)
from handrail.collect.world.tasks.goal_reaching import STEP, T_MAX, pose_error, sample_goal
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import Pose, load_model
from handrail.policies.rl.observation import base_velocity, check_robot, observe
from handrail.scripts.bench.rl.env import GoalReachingEnv, reward_of

SEEDS = st.integers(0, 2**32 - 1)
NEAR = Pose(np.array([-0.6, 0.3, 0.9]), np.eye(3))
HOME = load_model().pose(load_model().description.home)
FOLDED = Pose(HOME.position, pin.exp3(np.array([0.0, 0.0, -2.2])) @ HOME.rotation)
"""Reached with a base at rest, the palm meets the forearm on the way, without any tracking error."""
PARTS = ("q", "start", "twist", "current", "desired", "goal", "previous")


def poses(rng):
    return tuple((rng.uniform(-1, 1, 3), np.linalg.qr(rng.normal(size=(3, 3)))[0]) for _ in range(3))


def situation(rng):
    """Return what an observation is made of, by name."""
    q, start, twist, previous = (rng.uniform(-1, 1, size) for size in (9, 3, 6, 3))
    return dict(zip(PARTS, (q, start, twist, *poses(rng), previous), strict=True))


def seen(of):
    """Return the observation of a situation."""
    return observe(of["q"], of["start"], of["twist"], [of[name] for name in PARTS[3:6]], of["previous"])


def moved(before, shift, angle):
    """Return a situation with robot, twist and poses moved and turned on the floor together."""
    turn = turned(np.eye(3), angle)

    def pose(place):
        return turn @ place[0] + [*shift, 0.0], turn @ place[1]

    def base(place):
        return np.array([*(turn[:2, :2] @ place[:2] + shift), place[2] + angle])

    return before | {
        "q": np.concatenate([base(before["q"]), before["q"][3:]]),
        "start": base(before["start"]),
        "twist": np.concatenate([turn @ before["twist"][:3], turn @ before["twist"][3:]]),
        **{name: pose(before[name]) for name in PARTS[3:6]},
    }


def test_gymnasium_s_checker_is_content():
    check_env(GoalReachingEnv(), skip_render_check=True)


@given(SEEDS)
def test_an_observation_does_not_know_where_the_world_is(seed):
    rng = np.random.default_rng(seed)
    before = situation(rng)
    after = moved(before, rng.uniform(-2, 2, 2), rng.uniform(-3, 3))
    assert seen(before).shape == (54,)
    assert np.allclose(seen(before), seen(after), atol=1e-9)


@given(SEEDS, st.sampled_from(["q", "twist", "current", "desired", "goal", "previous"]))
def test_an_observation_shows_everything(seed, part):
    """Law: any other twist, pose, coordinate or action is another observation."""
    before, other = situation(np.random.default_rng(seed)), situation(np.random.default_rng(seed + 1))
    assert not np.allclose(seen(before), seen(before | {part: other[part]}))


def test_an_action_drives_the_base_in_its_own_frame():
    assert np.allclose(base_velocity(np.array([1.0, 0.0, -1.0]), np.pi / 2), [0.0, 0.4, -0.75])
    assert np.allclose(base_velocity(np.array([9.0, -9.0, 0.5]), 0.0), [0.4, -0.4, 0.375])


def test_the_previous_action_is_cleared_at_reset():
    env = GoalReachingEnv()
    first, _ = env.reset(seed=3)
    after, *_ = env.step(np.ones(3, np.float32))
    assert np.array_equal(after[-3:], [1.0, 1.0, 1.0])
    again, _ = env.reset(seed=3)
    assert np.array_equal(again, first)
    assert not again[-3:].any()


def test_the_same_seed_gives_the_same_episode():
    one, other = GoalReachingEnv(), GoalReachingEnv()
    for env in (one, other):
        env.action_space.seed(1)
        env.reset(seed=7)
    for _ in range(50):
        action = one.action_space.sample()
        assert np.array_equal(one.step(action)[0], other.step(action)[0])


@settings(max_examples=20)
@given(SEEDS)
def test_the_robot_keeps_its_limits_whatever_the_policy_does(seed):
    env = GoalReachingEnv(early_failure=False, physics=False)
    env.reset(seed=seed)
    rng, limits = np.random.default_rng(seed), env.model.description.limits
    for _ in range(60):
        before_q, before_v = env.q, env.velocity
        env.step(rng.choice([-1.0, 1.0], 3))
        assert np.array_equal(env.velocity, env.command)
        assert np.all(np.abs(env.velocity) <= limits.velocity + 1e-9)
        assert np.all(np.abs(env.velocity - before_v) <= limits.acceleration * STEP + 1e-9)
        assert np.allclose(env.q, before_q + 0.5 * STEP * (before_v + env.velocity))


def test_reward_is_the_paper_s():
    action, previous = np.array([0.5, 0.0, -1.0]), np.array([0.0, 1.0, -1.0])
    expected = -0.5 * (0.2**2 / 0.1**2 + 0.1**2 / 0.05**2) - 0.05 * 1.25 - 0.05 * 1.25
    assert reward_of(0.2, 0.1, action, previous) == pytest.approx(expected)


def run(env, action):
    env.reset(options={"goal": NEAR})
    lost, info, terminated, truncated = 0, {}, False, False
    while not (terminated or truncated):
        *_, terminated, truncated, info = env.step(action)
        tool = env.model.pose(env.q)
        d, r = pose_error(tool.position, tool.rotation, Pose(*env.planner.pose(env.time)))
        lost += d > 0.1 or r > 0.05
    return lost, terminated, truncated, info


def test_an_episode_that_leaves_the_plan_is_given_up_after_twenty_steps():
    lost, terminated, truncated, info = run(GoalReachingEnv(), np.array([-1.0, 0.0, 0.0]))
    assert (lost, terminated, truncated) == (20, True, False)
    assert info["failed"]
    assert not info["is_success"]


def touch(env: GoalReachingEnv) -> tuple[int, float, bool, bool]:
    """Let the arm turn the tool until the robot touches itself; return what the last step said."""
    env.reset(options={"goal": FOLDED})
    for t in range(T_MAX):
        *_, reward, terminated, _, info = env.step(np.zeros(3))
        if terminated or info["touches"]:
            return t, reward, terminated, info["failed"]
    raise RuntimeError("it never touched itself")


@pytest.mark.parametrize("physics", [True, False])
def test_an_episode_in_which_the_robot_touches_itself_is_given_up_at_its_cost(physics):
    """Law: the contact ends the episode at once, and costs what giving up costs."""
    ends = touch(GoalReachingEnv(physics=physics, failure_cost=50.0))
    goes_on = touch(GoalReachingEnv(physics=physics, early_failure=False))
    assert ends[0] == goes_on[0]
    assert ends[2:] == (True, True)
    assert goes_on[2:] == (False, False)
    assert ends[1] == pytest.approx(goes_on[1] - 50.0)


def give_up(env: GoalReachingEnv) -> None:
    """Drive away until the episode is given up."""
    terminated = False
    while not terminated:
        *_, terminated, _, info = env.step(np.array([-1.0, 0.0, 0.0]))
    assert info["failed"]


@pytest.mark.parametrize("repeats", [0.0, 1.0])
def test_a_missed_goal_is_tried_again_where_that_is_asked_for(repeats):
    env, rng = GoalReachingEnv(physics=False, repeat_missed=repeats), np.random.default_rng(5)
    env.reset(seed=5)
    first = sample_goal(rng).position
    for _ in range(3):
        assert np.array_equal(env.planner.goal.position, first)
        give_up(env)
        env.reset()
        first = first if repeats else sample_goal(rng).position
    if repeats:
        env.reset()  # it was not missed again
        assert not np.array_equal(env.planner.goal.position, first)


def test_an_evaluation_goes_on_to_the_last_step():
    env = GoalReachingEnv(early_failure=False)
    lost, terminated, truncated, info = run(env, np.array([-1.0, 0.0, 0.0]))
    assert lost > 20
    assert (terminated, truncated) == (False, True)
    assert env.time == T_MAX
    assert not info["failed"]


def test_a_robot_without_a_base_is_refused(tmp_path):
    text = SMALL_ROBOT.replace("planar", "fixed")
    text = re.sub(r"^(\w+ = \[)(\S+, ){3}(?=(\S+, ){5}\S+\]$)", r"\1", text, flags=re.MULTILINE)
    path = tmp_path / "fixed.toml"
    path.write_text(text)
    with pytest.raises(HandrailError, match="expected the joints and arm of ridgeback_ur10"):
        check_robot(load_model(path))

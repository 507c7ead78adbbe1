"""Laws of the command profiles: faster or jerkier, they lead to the same place."""

import numpy as np
import pinocchio as pin
import pytest

from handrail.collect.world.tasks.goal_reaching import STEP, T_MAX, StraightPlanner, pose_error, sample_goal
from handrail.controllers.robot.model import load_model
from handrail.scripts.bench.goal_reaching.config import PROFILES
from handrail.scripts.bench.goal_reaching.profiles import NOTHING_YET, SPEEDS, profile_commands

MODEL = load_model()
HERE = MODEL.pose(MODEL.description.home)
WATCHDOG = 0.25  # [s]
RANDOM = ("noise", "delay", "dropouts")


def planner(seed, profile="nominal"):
    goal = sample_goal(np.random.default_rng(seed))
    return StraightPlanner.plan(HERE.position, HERE.rotation, goal, speed=SPEEDS.get(profile, 1.0))


def commands(seed, profile):
    return profile_commands(profile, planner(seed, profile), np.random.default_rng(seed))


def arrival(seed, profile):
    """Return the errors of a hand that does exactly what arrives, and rests when messages are stale."""
    sent, position, rotation = commands(seed, profile), HERE.position, HERE.rotation
    for step in range(T_MAX):
        index = sent.delivered[step]
        if index == NOTHING_YET or (step - index) * STEP > WATCHDOG:
            continue
        twist = sent.twists[index]
        position = position + STEP * twist[:3]
        rotation = pin.exp3(STEP * twist[3:]) @ rotation
    return pose_error(position, rotation, planner(seed, profile).goal)


@pytest.mark.parametrize("profile", PROFILES)
def test_a_perfect_hand_arrives(profile):
    """Every profile keeps the displacement: noise, jitter, gaps and keys within a little."""
    allowed = {
        "noise": (0.04, 0.01),
        "delay": (0.01, 0.002),
        "dropouts": (0.025, 0.002),
        "quantised": (0.04, 0.02),
    }
    for seed in range(8):
        d_p, d_r = arrival(seed, profile)
        largest = allowed.get(profile, (1e-9, 1e-9))
        assert d_p <= largest[0], (seed, d_p)
        assert d_r <= largest[1], (seed, d_r)


@pytest.mark.parametrize("profile", PROFILES)
def test_a_profile_is_what_its_seed_says(profile):
    first, again, other = commands(1, profile), commands(1, profile), None
    np.testing.assert_array_equal(first.twists, again.twists)
    np.testing.assert_array_equal(first.delivered, again.delivered)
    other = profile_commands(profile, planner(1, profile), np.random.default_rng(2))
    same = np.array_equal(first.twists, other.twists) and np.array_equal(first.delivered, other.delivered)
    assert same == (profile not in RANDOM)


@pytest.mark.parametrize("profile", PROFILES)
def test_no_message_comes_before_it_is_sent_or_out_of_order(profile):
    delivered = commands(3, profile).delivered
    assert np.all(delivered <= np.arange(T_MAX))
    assert np.all(np.diff(delivered) >= 0)
    assert delivered.min() >= NOTHING_YET


def test_faster_is_shorter():
    usual = commands(4, "nominal")
    for profile, speed in SPEEDS.items():
        fast = commands(4, profile)
        assert abs(fast.end - usual.end / speed) <= 1
        np.testing.assert_allclose(
            np.linalg.norm(fast.twists[0]), speed * np.linalg.norm(usual.twists[0]), rtol=0.01
        )


def test_jerky_profiles_are_jerky():
    """Each changes its twist far more often, or more, than the one that only starts and stops."""
    change = {
        profile: np.abs(np.diff(commands(5, profile).twists, axis=0)).sum()
        for profile in ("nominal", "steps", "noise", "quantised")
    }
    assert all(change[profile] > 5 * change["nominal"] for profile in ("steps", "noise", "quantised"))
    assert np.max(np.arange(T_MAX) - commands(5, "dropouts").delivered) * STEP > WATCHDOG
    assert np.max(np.arange(T_MAX) - commands(5, "delay").delivered) * STEP < WATCHDOG


@pytest.mark.parametrize("profile", PROFILES)
def test_after_the_end_nothing_is_asked(profile):
    sent = commands(6, profile)
    arriving = [sent.twists[index] for index in sent.delivered[sent.end :] if index != NOTHING_YET]
    assert len(arriving) == T_MAX - sent.end
    np.testing.assert_array_equal(arriving, 0.0)
    assert np.any(sent.twists[sent.delivered[sent.end - 1]])

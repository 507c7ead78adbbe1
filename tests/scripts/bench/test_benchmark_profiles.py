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


@pytest.mark.parametrize("profile", PROFILES)
def test_after_the_end_nothing_is_asked(profile):
    sent = commands(6, profile)
    arriving = [sent.twists[index] for index in sent.delivered[sent.end :] if index != NOTHING_YET]
    assert len(arriving) == T_MAX - sent.end
    np.testing.assert_array_equal(arriving, 0.0)
    assert np.any(sent.twists[sent.delivered[sent.end - 1]])

"""Who drives now: laws of all arbiters, and each one's own."""

from dataclasses import replace

import numpy as np
import pytest
from arbiter_helpers import ONE, TWO, Course, arbiter, asks, channels_of

from handrail.collect.operators.shared.arbiter import Groups, Wishes
from handrail.collect.operators.shared.catalogue import ARBITERS
from handrail.collect.operators.shared.settings import ArbiterSettings
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.intent import Intent

NAMES = ["by_mask", "whole", "blend", "emics", "hier_emics", "risk"]
BY_INPUT = ["by_mask", "whole", "blend", "risk"]
CHANNELS = channels_of(ONE)
RESTS = asks("base", "ee", value=0.0)
PUSHES = asks("base")
POLICY = asks("base", "ee", value=0.1)


def test_the_catalogue_has_them_all():
    assert [spec.name for spec in ARBITERS.built_in] == NAMES


@pytest.mark.parametrize(
    ("name", "value"),
    [("alpha", 1.5), ("alpha", np.nan), ("handback", -1.0), ("window", 0.0), ("error", 0.0), ("doubt", 0.0)],
)
def test_wrong_numbers_are_refused(name, value):
    with pytest.raises(HandrailError, match=rf"^--arbitration.{name}: expected a number"):
        ArbiterSettings(**{name: value})


@pytest.mark.parametrize("model", [ONE, TWO], ids=["one hand", "two hands"])
@pytest.mark.parametrize("name", NAMES)
def test_for_any_wish_shares_are_from_0_to_1_and_owners_do_not_contradict(name, model):
    rng, decides, groups = np.random.default_rng(3), arbiter(name, model), Groups(channels_of(model))
    size, time = groups.channels.size, 0.0
    for _ in range(400):
        time += rng.choice([0.05, 0.0, 7.0, -3.0], p=[0.94, 0.02, 0.02, 0.02])
        push = rng.choice([0.0, 1e-4, 1.0, 1e6], p=[0.3, 0.1, 0.5, 0.1])
        person, policy = (
            Intent(scale * rng.normal(0, 1, size), rng.random(size) < rng.choice([0.05, 0.4, 1.0]))
            for scale in (push, rng.choice([0.0, 0.3, 1e6]))
        )
        doubt, done = rng.choice([0.0, 0.07, 1.0, np.nan]), rng.choice([0.0, 0.5, np.nan]) * np.ones(size)
        wished = Wishes(time, person, None if rng.random() < 0.1 else policy, done, doubt)
        shares = decides.shares(wished)
        assert shares.person.shape == shares.policy.shape == (size,)
        assert np.all((np.array(shares) >= 0.0) & (np.array(shares) <= 1.0))
        owned = person.mask & (shares.person > 0.0)
        if name != "blend":
            assert not np.any(groups.taken(owned) & (shares.policy > 0.0) & policy.mask)
        if wished.policy is None:
            for _ in range(3 * ("emics" in name)):  # for a moment they wait for it
                time += 0.4
                shares = decides.shares(replace(wished, time=time))
            moved = groups.moved(person)
            assert np.all(shares.person[moved] > 0.0)


@pytest.mark.parametrize("doubt", [0.0, 5.0])
@pytest.mark.parametrize("name", NAMES)
def test_a_person_owns_at_once_channels_that_they_begin_to_move(name, doubt):
    course = Course(arbiter(name))
    before = course.go(RESTS, POLICY, 5.0, realised=POLICY.values)
    assert not np.any(before.person[RESTS.mask])
    assert np.all(before.policy[POLICY.mask] == 1.0)
    shares = course.go(PUSHES, POLICY, doubt=doubt)
    mine = 0.5 if name == "blend" else 1.0
    assert np.all(shares.person[PUSHES.mask] == mine)
    assert np.all(shares.policy[PUSHES.mask] == 1.0 - mine)


@pytest.mark.parametrize("name", BY_INPUT)
def test_it_goes_back_a_moment_after_it_was_let_go(name):
    course = Course(arbiter(name))
    course.go(PUSHES, POLICY, 1.0)
    assert np.all(course.go(RESTS, POLICY, 0.45).person[CHANNELS.base_slice] > 0.0)
    shares = course.go(RESTS, POLICY, 0.1)
    assert not np.any(shares.person[RESTS.mask])
    assert np.all(shares.policy == 1.0)


@pytest.mark.parametrize("name", BY_INPUT)
def test_without_a_moment_more_it_is_theirs_while_it_moves(name):
    course = Course(arbiter(name, handback=0.0))
    assert np.all(course.go(PUSHES, POLICY).person[PUSHES.mask] > 0.0)
    assert not np.any(course.go(RESTS, POLICY).person[RESTS.mask])


@pytest.mark.parametrize("name", NAMES)
def test_a_new_episode_is_as_the_first(name):
    def told(decides):
        course = Course(decides)
        parts = [(RESTS, 2.0), (PUSHES, 5.0), (RESTS, 3.0), (PUSHES, 1.0)]
        return [course.go(who, POLICY, seconds, doubt=0.06) for who, seconds in parts]

    decides = arbiter(name)
    first = told(decides)
    Course(decides).go(PUSHES, POLICY, 1.0, doubt=1.0)
    decides.reset()
    assert np.array_equal(told(decides), first)


@pytest.mark.parametrize("name", BY_INPUT)
def test_a_clock_that_is_set_back_leaves_nothing_in_the_person_s_hands(name):
    course = Course(arbiter(name))
    course.time = 60.0
    course.go(PUSHES, POLICY)
    course.time = 10.0
    assert not np.any(course.go(RESTS, POLICY).person[RESTS.mask])


def test_by_mask_leaves_the_policy_what_is_not_moved():
    shares = Course(arbiter("by_mask")).go(PUSHES, POLICY)
    assert np.array_equal(shares.policy > 0.0, ~Groups(CHANNELS).taken(PUSHES.mask))
    assert np.all(shares.policy[CHANNELS.hand_slice()] == 1.0)


def test_whole_leaves_the_policy_nothing():
    shares = Course(arbiter("whole")).go(PUSHES, POLICY)
    assert np.all(shares.person == 1.0)
    assert np.all(shares.policy == 0.0)


@pytest.mark.parametrize("seed", range(10))
def test_blend_without_a_share_is_by_mask(seed):
    rng, size = np.random.default_rng(seed), channels_of(TWO).size
    person, policy = (Intent(rng.normal(0, 0.2, size), rng.random(size) < 0.3) for _ in range(2))
    found, expected = (
        Course(arbiter(name, TWO, **numbers)).go(person, policy)
        for name, numbers in {"blend": {"alpha": 0.0}, "by_mask": {}}.items()
    )
    for mine, theirs, mask in zip(found, expected, (person.mask, policy.mask), strict=True):
        assert np.array_equal(mine[mask], theirs[mask])


@pytest.mark.parametrize("alpha", [0.0, 0.3, 1.0])
def test_blend_shares_what_both_ask_for_and_nothing_else(alpha):
    person, policy = asks("base", "ee"), asks("ee", value=0.1)
    shares = Course(arbiter("blend", alpha=alpha)).go(person, policy)
    hand, base = CHANNELS.hand_slice(), CHANNELS.base_slice
    assert np.allclose(shares.person[hand], 1.0 - alpha)
    assert np.allclose(shares.policy[hand], alpha)
    assert np.all(shares.person[base] == 1.0)


def test_risk_lets_go_at_one_doubt_and_drives_again_at_half_of_it():
    course = Course(arbiter("risk", doubt=0.1))
    doubts = [0.0, 0.09, 0.11, 0.07, 0.051, 0.049, 0.09, np.nan, 0.0]
    drives = [course.go(RESTS, POLICY, doubt=doubt).policy.any() for doubt in doubts]
    assert drives == [True, True, False, False, False, True, True, False, True]
    assert not course.go(RESTS, POLICY, doubt=1.0).person[RESTS.mask].any(), "nobody drives"
    helped = course.go(PUSHES, POLICY, doubt=1.0)
    assert np.all(helped.person[PUSHES.mask] == 1.0)
    assert not helped.policy.any()

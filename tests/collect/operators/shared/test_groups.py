"""What a person takes with what they move: laws of groups of channels."""

from dataclasses import replace

import numpy as np
import pytest
from arbiter_helpers import ONE, TWO, asks, channels_of

from handrail.collect.operators.shared.arbiter import Groups
from handrail.controllers.interface.intent import Intent, RawInput

ROBOTS = pytest.mark.parametrize("model", [ONE, TWO], ids=["one hand", "two hands"])
GROUPS = Groups(channels_of(TWO))


def mask(*names):
    return GROUPS.channels.mask(*names)


@ROBOTS
def test_the_groups_are_all_channels_each_once(model):
    groups = Groups(channels_of(model))
    assert np.array_equal(np.sum(list(groups.masks.values()), axis=0), np.ones(groups.channels.size))


@ROBOTS
@pytest.mark.parametrize("seed", range(20))
def test_more_that_is_owned_takes_more_and_at_least_itself(model, seed):
    rng, groups = np.random.default_rng(seed), Groups(channels_of(model))
    many = rng.random(groups.channels.size) < rng.uniform(0.02, 0.9)
    few = many & (rng.random(many.size) < 0.5)
    assert not np.any(few & ~groups.taken(few))
    assert not np.any(groups.taken(few) & ~groups.taken(many))
    assert not groups.taken(np.zeros_like(few)).any()


@pytest.mark.parametrize(
    ("owned", "lost", "kept"),
    [
        (["base.vx"], ["base", "joint.x", "joint.y", "joint.theta"], ["ee", "arm", "pair", "torso"]),
        (["joint.theta"], ["base", "joint.x"], ["ee", "arm", "pair"]),
        (["left.vx"], ["left", "left.arm", "pair", "apart"], ["right", "right.arm", "base", "torso"]),
        (["left.arm"], ["left", "left.arm", "pair"], ["right", "right.arm", "base", "torso"]),
        (["joint.arm_left_3_joint"], [], ["left", "pair", "right", "base"]),
        (["pair.wz"], ["left", "right", "left.arm", "right.arm", "apart"], ["base", "torso"]),
        (["joint.torso_lift_joint"], [], ["ee", "pair", "base", "left.arm"]),
    ],
)
def test_contradicting_channels_are_taken_and_others_kept(owned, lost, kept):
    taken = GROUPS.taken(mask(*owned))
    assert np.all(taken[mask(*lost)])
    assert not np.any(taken & mask(*kept) & ~mask(*owned))


@ROBOTS
@pytest.mark.parametrize("seed", range(20))
def test_one_axis_moves_its_owned_group_and_no_other(model, seed):
    rng, groups = np.random.default_rng(seed), Groups(channels_of(model))
    owned = rng.random(groups.channels.size) < 0.7
    one = rng.choice(np.flatnonzero(owned))
    values = np.where(owned, rng.uniform(-9e-4, 9e-4, owned.size), np.nan)  # a hand that rests
    assert not groups.moved(Intent(values, owned)).any()
    values[one] = rng.choice([-1.0, 1.0]) * 2e-3
    group = next(each for each in groups.masks.values() if each[one])
    assert np.array_equal(groups.moved(Intent(values, owned)), owned & group)


def test_a_device_that_says_that_nothing_is_deflected_moves_nothing():
    """Values can be other than zero all the same: a twist that was locked to another."""
    moving = asks("ee", raw=RawInput(device="gamepad", axes=2))
    groups = Groups(channels_of(ONE))
    assert groups.moved(moving).any()
    assert not groups.moved(replace(moving, raw=RawInput(device="gamepad"))).any()


@pytest.mark.parametrize(
    ("owned", "has"),
    [
        (["left.vx"], (True, False)),
        (["joint.arm_right_7_joint"], (False, True)),
        (["pair.vx"], (True, True)),
        (["base", "torso"], (False, False)),
    ],
)
def test_a_gripper_goes_with_its_hand_its_arm_and_the_pair(owned, has):
    assert GROUPS.grippers(mask(*owned)) == has

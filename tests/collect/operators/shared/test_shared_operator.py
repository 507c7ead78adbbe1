"""A person and a policy as one operator: who is heard, what brakes, whose the grippers are."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from arbiter_helpers import ONE, TWO, Both, Fake, arbiter, asks, channels_of
from ideal_robot import Robot, without_shapes

from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.shared.catalogue import ARBITERS
from handrail.collect.operators.shared.shared_operator import SharedOperator
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import LONG_AGO, Intent
from handrail.controllers.interface.sources import PERSON, POLICY
from handrail.controllers.mpc.masked_mpc import MaskedMpc

NAMES = [spec.name for spec in ARBITERS.built_in]
CHANNELS, BASE = channels_of(ONE), channels_of(ONE).base_slice
RESTS, PUSHES = asks("base", "ee", value=0.0), asks("base")
DRIVES = asks("base", "ee", value=0.1)
UNUSABLE = {
    "NaN": replace(DRIVES, values=np.full(CHANNELS.size, np.nan)),
    "other size": Intent(np.zeros(3), np.ones(3, bool)),
    "unknown frames": replace(DRIVES, frames=Frames("moon")),
    "NaN of a gripper": replace(DRIVES, grippers=(np.nan,)),
    "too many grippers": replace(DRIVES, grippers=(0.0, 1.0)),
}
REST = np.zeros(ONE.size)


def status(intent, time):
    """Return what the controller makes of an intent."""
    return MaskedMpc(ONE).update(State(ONE.description.home, REST, time), intent).diagnostics.status


@pytest.mark.parametrize("event", EpisodeEvent)
@pytest.mark.parametrize("name", NAMES)
def test_a_person_s_word_on_the_episode_comes_first(name, event):
    """The policy is not even asked, whoever drives."""
    for before in (RESTS, PUSHES):
        both = Both(name)
        both.act(before, seconds=1.0)
        both.policy.calls.clear()
        assert both.act(event, seconds=1.0) is event
        assert both.policy.calls == []


@pytest.mark.parametrize("name", NAMES)
def test_the_policy_plans_anew_after_a_pause_before_it_is_asked(name):
    both = Both(name)
    both.act(RESTS, seconds=1.0)
    both.act(EpisodeEvent.PAUSE, seconds=1.0)
    both.policy.calls.clear()
    both.act(RESTS, seconds=0.1)
    assert both.policy.calls == ["replan", "act", "act"]


@pytest.mark.parametrize("name", NAMES)
def test_the_policy_plans_anew_when_it_gets_something_back_and_never_else(name):
    both = Both(name, window=0.5, dwell=0.5)
    both.act(RESTS, seconds=0.4)
    both.act(PUSHES, seconds=0.4)
    assert both.policy.replans == 0
    both.act(RESTS, seconds=1.0)
    assert both.policy.replans == 1


def test_a_policy_that_was_unsure_plans_anew():
    both = Both("risk")
    for doubt, replans in ((0.0, 0), (1.0, 0), (0.0, 1), (0.0, 1)):
        both.policy.doubt = doubt
        both.act(RESTS, seconds=0.5)
        assert both.policy.replans == replans


@pytest.mark.parametrize("bad", UNUSABLE)
@pytest.mark.parametrize("name", NAMES)
def test_an_unusable_policy_leaves_the_person_alone_and_the_robot_at_rest(name, bad):
    both = Both(name)
    both.act(RESTS, DRIVES, 1.0)
    found = both.act(PUSHES, UNUSABLE[bad])
    assert np.array_equal(found.mask, PUSHES.mask)
    assert np.array_equal(found.values[BASE], PUSHES.values[BASE])
    assert [source.name for source in found.sources] == [PERSON]
    assert found.grippers == (0.0,)
    assert status(found, both.time) is Status.OK
    found = both.act(RESTS, UNUSABLE[bad], 1.0)
    assert found.time == LONG_AGO
    assert status(found, both.time) is Status.STALE_INTENT


LATER = {
    **{name: bad for name, bad in UNUSABLE.items() if name != "too many grippers"},
    "inf": replace(DRIVES, values=np.full(CHANNELS.size, np.inf)),
    "NaN of one channel": replace(DRIVES, values=np.where(np.arange(CHANNELS.size), 0.1, np.nan)),
    "NaN where only that row has no mask": replace(PUSHES, values=np.where(PUSHES.mask, 0.1, np.nan)),
    "NaN of its time": replace(DRIVES, time=np.nan),
}


@pytest.mark.parametrize("bad", LATER)
def test_a_plan_with_one_bad_row_is_unusable_as_a_bad_intent_is(bad):
    """Its last row may be far from now: what a policy says of later is used now."""
    both = Both()
    both.policy.plans = [replace(DRIVES, time=0.5 * row) for row in range(1, 40)]
    found = both.act(RESTS, DRIVES, 1.0)
    assert status(found, both.time) is Status.OK
    assert found.source(POLICY).predict is not None
    both.policy.plans[-1] = LATER[bad]
    found = both.act(PUSHES)
    assert [source.name for source in found.sources] == [PERSON]
    assert status(found, both.time) is Status.OK
    found = both.act(RESTS, seconds=1.0)
    assert status(found, both.time) is Status.STALE_INTENT


@pytest.mark.parametrize("bad", [*UNUSABLE][:2] + [*UNUSABLE][3:])
def test_a_person_whose_wish_makes_no_sense_brakes_the_robot(bad):
    both = Both()
    found = both.act(UNUSABLE[bad])
    assert status(found, both.time) is Status.INVALID_INTENT


@pytest.mark.parametrize("name", NAMES)
def test_the_policy_moves_only_while_the_person_s_input_is_fresh(name):
    both = Both(name)
    found = both.act(RESTS, DRIVES, 1.0)
    assert status(found, both.time) is Status.OK
    both.person.age = 0.3
    assert status(both.act(), both.time) is Status.STALE_INTENT


def test_an_unsure_policy_and_a_person_who_rests_brake_the_robot():
    both = Both("risk")
    both.act(RESTS, replace(DRIVES, grippers=(1.0,)), 1.0)
    both.policy.doubt = 1.0
    found = both.act(RESTS, replace(DRIVES, grippers=(0.0,)))
    assert not found.mask.any()
    assert found.grippers == (1.0,), "it holds what it has"
    assert found.of_grippers == (PERSON,)
    assert status(found, both.time) is Status.STALE_INTENT


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "asked",
    [
        asks("joint", mode="direct"),
        replace(asks("ee.vx", "ee.wz"), frames=Frames(tool="tool")),
    ],
)
def test_an_intent_that_cannot_be_shared_is_the_person_s_alone(name, asked):
    both = Both(name, shares=lambda mode: mode != "direct")
    both.act(RESTS, replace(DRIVES, grippers=(1.0,)), 1.0)
    found = both.act(asked)
    assert type(found) is Intent
    assert np.array_equal(found.values, asked.values)
    assert np.array_equal(found.mask, asked.mask)
    assert (found.mode, found.frames, found.time) == (asked.mode, asked.frames, both.time)
    assert found.grippers == (1.0,), "what the policy grasped is not dropped"
    assert both.act(replace(asked, grippers=(1.0,))).grippers == (0.0,)
    both.policy.calls.clear()
    both.act(RESTS, seconds=1.0)
    assert both.policy.replans == 1


@pytest.mark.parametrize("tool", ["world", "tool"])
def test_a_person_is_heard_in_their_own_frames(tool):
    both = Both()
    found = both.act(replace(asks("ee"), frames=Frames(tool=tool)))
    rotation = ONE.pose(ONE.description.home).rotation if tool == "tool" else np.eye(3)
    expected = np.concatenate([rotation @ [0.2, 0.2, 0.2]] * 2)
    assert np.allclose(found.values[CHANNELS.hand_slice()], expected)


def grippers(both, person, policy, levels=(0.0,), **other):
    """Return who has each gripper, and how far it is closed, as the person's device and the policy say."""
    found = both.act(replace(person, grippers=levels), replace(both.policy.says, grippers=policy), **other)
    return found.grippers, found.of_grippers


def test_the_gripper_is_the_policy_s_while_the_person_has_nothing_of_its_hand():
    both = Both()
    assert grippers(both, RESTS, (1.0,)) == ((1.0,), (POLICY,))
    assert grippers(both, PUSHES, (0.0,)) == ((0.0,), (POLICY,)), "the base is not the hand"


@pytest.mark.parametrize("held", [0.0, 1.0])
def test_a_gripper_stays_as_it_is_in_the_person_s_hand(held):
    both = Both()
    grippers(both, RESTS, (held,))
    assert grippers(both, asks("ee"), (1.0 - held,), seconds=1.0) == ((held,), (PERSON,))
    assert grippers(both, RESTS, (1.0 - held,), seconds=0.4)[1] == (PERSON,)
    assert grippers(both, RESTS, (1.0 - held,), seconds=0.3) == ((1.0 - held,), (POLICY,))


@pytest.mark.parametrize("held", [0.0, 1.0])
@pytest.mark.parametrize("level", [0.0, 1.0])
def test_a_change_closes_what_is_open_and_opens_what_is_closed(held, level):
    """Whatever the device's switch stands at."""
    both = Both()
    grippers(both, RESTS, (held,), (level,))
    grippers(both, RESTS, (held,), (level,), seconds=0.6)
    assert grippers(both, RESTS, (held,), (1.0 - level,)) == ((1.0 - held,), (PERSON,))
    assert grippers(both, RESTS, (held,), (1.0 - level,), seconds=0.6) == ((held,), (POLICY,))


def test_a_press_before_the_beginning_counts():
    both = Both()
    assert grippers(both, RESTS, (0.0,), (1.0,)) == ((1.0,), (PERSON,))


def test_each_hand_s_gripper_has_an_owner():
    both = Both(model=TWO)
    rests = asks("ee", value=0.0, model=TWO)
    grippers(both, rests, (1.0, 1.0), (0.0, 0.0))
    left = asks("left", model=TWO)
    assert grippers(both, left, (0.0, 0.0), (0.0, 0.0)) == ((1.0, 0.0), (PERSON, POLICY))


@pytest.mark.parametrize("name", ["whole", "emics", "hier_emics"])
def test_a_policy_that_drives_nothing_moves_no_gripper(name):
    """Though the person has the base alone."""
    both = Both(name)
    grippers(both, RESTS, (1.0,))
    assert grippers(both, PUSHES, (0.0,), seconds=0.3) == ((1.0,), (PERSON,))


@pytest.mark.parametrize("name", NAMES)
def test_hand_overs_keep_the_limits_of_acceleration(name):
    """Both ask for full speed in opposite ways, and change their minds all the time."""
    rng, model = np.random.default_rng(11), without_shapes(ONE.description)
    person, policy = Fake(RESTS), Fake(DRIVES)
    decides = arbiter(name, alpha=0.5, dwell=0.2, window=0.2, handback=0.1)
    operator = SharedOperator(person, policy, decides, model)
    robot, owners = Robot(MaskedMpc(model)), set()
    operator.reset(View(robot.state, None), rng)
    groups = [("base",), ("ee",), ("joint",), ("base", "ee"), ("ee", "joint.theta"), ()]
    for step in range(240):
        if step % int(rng.integers(1, 8)) == 0:
            person.says = asks(*groups[rng.integers(6)], value=rng.choice([0.0, 0.0, 1.0, -1.0]))
            policy.says = asks(*groups[rng.integers(6)], value=rng.choice([1.0, -1.0, np.nan]))
            policy.doubt = rng.choice([0.0, 1.0])
        found: Any = operator.act(View(robot.state, None))
        robot.update(found)
        owners.add(tuple(source.name for source, *_ in found.terms))
    limits = ONE.description.limits
    assert np.max(np.abs(robot.steps) / (limits.acceleration * robot.period)) < 1.0 + 1e-6
    speeds = [command.velocity(0.0) for command in robot.commands]
    assert np.max(np.abs(speeds) / limits.velocity) < 1.0 + 1e-6
    assert np.max(np.abs(speeds)) > 0.3, "a robot that freezes keeps limits too"
    assert {(), (PERSON,), (POLICY,)} <= owners


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_the_person_s_of_a_time_that_was_undone(name):
    both = Both(name)
    both.act(RESTS, DRIVES, 5.0)
    both.act(PUSHES, seconds=1.0)
    both.act(EpisodeEvent.PAUSE)
    both.act(EpisodeEvent.UNDO)
    both.time = 2.0
    for _ in range(100):  # past the moment of the push
        found = both.act(RESTS)
        person = {each.name: each for each in found.sources}.get(PERSON)
        assert person is None or not (person.share() > 0.0).any()

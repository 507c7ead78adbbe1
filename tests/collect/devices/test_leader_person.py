"""Laws of a person with a leader arm: the clutch moves the arm, the other hand the base; nothing jumps."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from arbiter_helpers import Fake, arbiter, asks
from device_players import recorded
from driven_person import ARM, CHANNELS, LEADER, MODEL, Driven

from handrail.collect.devices.follower import Follower
from handrail.collect.devices.local_person import LocalPerson
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.operators.person.inputs import Ask
from handrail.collect.operators.shared.shared_operator import SharedOperator

CLUTCH = {"keyboard": "'", "gamepad": "right_shoulder"}
ALL = CHANNELS.joint_slice
REST = {"pan.pos": 40.0, "lift.pos": -10.0, "handle.pos": 100.0}


@pytest.fixture(params=CLUTCH)
def driven(request):
    made = Driven("so101_leader", "leader", request.param, Follower(MODEL, LEADER))
    made.main.joints = dict(REST)
    made.begin()
    return made


def clutch(driven, down=True):
    driven.beside.values[CLUTCH[driven.beside.name]] = float(down)


def arm(driven):
    return driven.act().values[ALL][3:]


def turn(driven, **degrees):
    driven.main.joints = {
        name: value + degrees.get(name.split(".")[0], 0.0) for name, value in driven.main.joints.items()
    }


def test_the_arm_moves_as_the_leader_does_since_the_clutch_held(driven):
    clutch(driven)
    arm(driven)
    turn(driven, pan=1.0, lift=1.0)
    moved = arm(driven)
    assert moved[:2] == pytest.approx([6.0 * np.pi / 180, -6.0 * np.pi / 180])  # within the speed of the mode
    assert not moved[2:].any()


def test_recorded_motion_is_followed_by_the_same_angle(driven):
    """The arm goes where it is told at once here; the leader turns by 17.4 degrees."""
    driven.person.ask(Ask("speed", 1.0))
    events = recorded("leader.json")
    clutch(driven)
    begun = driven.q.copy()
    for event in events:
        action = event["action"]
        driven.main.joints = {
            "pan.pos": action["shoulder_pan.pos"],
            "lift.pos": action["elbow_flex.pos"],
            "handle.pos": 100.0,
        }
        for _ in range(20):  # the robot follows with a lag; let it
            driven.q = driven.q + 0.05 * driven.act().values[ALL]
    turned = np.degrees(driven.q - begun)[3:]
    names = ("shoulder_pan.pos", "elbow_flex.pos")
    wanted = [events[-1]["action"][name] - events[0]["action"][name] for name in names]
    assert turned[:2] == pytest.approx([wanted[0], -wanted[1]], abs=0.1)
    assert driven.act().raw.values[CHANNELS.size - len(ARM) :] == pytest.approx(driven.q[3:], abs=0.01)


def test_the_other_hand_drives_the_base_meanwhile(driven):
    clutch(driven)
    arm(driven)
    if driven.beside.name == "gamepad":
        driven.beside.values["left_y"] = -1.0
        assert not driven.act().values[CHANNELS.base_slice].any()  # its shoulder is not held
        driven.beside.values["left_shoulder"] = 1.0
    else:
        driven.beside.values["i"] = 1.0
    turn(driven, pan=1.0)
    values = driven.act().values
    assert values[CHANNELS.base_slice][0] == pytest.approx(0.3)
    assert values[ALL][3] > 0.0


@pytest.mark.parametrize("which", ["main", "beside"])
@pytest.mark.parametrize("trouble", ["left alone", "hangs", "gone"])
def test_any_doubt_about_either_hand_brakes_until_the_clutch_was_let_go(driven, which, trouble):
    device = getattr(driven, which)
    clutch(driven)
    arm(driven)
    turn(driven, pan=3.0)
    assert arm(driven).any()
    began = driven.clock.now
    device.attended, device.gone = trouble != "left alone", trouble == "gone"
    device.time = driven.clock.now if trouble == "hangs" else None
    while driven.act() is not EpisodeEvent.PAUSE:
        assert driven.clock.now - began < 0.3
    device.attended, device.gone, device.time = True, False, None
    turn(driven, pan=30.0)
    assert driven.act() is EpisodeEvent.PAUSE
    clutch(driven, False)
    driven.act()
    if trouble == "gone":
        driven.beside.presses = ["start" if driven.beside.name == "gamepad" else "enter"]
    assert not arm(driven).any()
    clutch(driven)
    assert np.abs(arm(driven)).max() < 1e-9


def test_its_handle_is_the_gripper(driven):
    assert driven.act().grippers == (0.0,)
    for place, closed in ((55.0, 0.0), (30.0, 1.0), (55.0, 1.0), (70.0, 0.0)):
        driven.main.joints["handle.pos"] = place
        assert driven.act().grippers == (closed,)


def test_its_handle_is_the_gripper_beside_a_policy_too(driven):
    """Whatever the policy has done with it meanwhile."""
    rests, grippers = asks("ee", value=0.0), (0.0,)
    person = LocalPerson(driven.person, driven.main, driven.beside, Follower(MODEL, LEADER), shared=True)
    shared = SharedOperator(person, policy := Fake(rests), arbiter("by_mask"), MODEL)
    shared.reset(driven.view(), np.random.default_rng(0))

    def act(place) -> Any:
        driven.main.joints["handle.pos"] = place
        driven.clock.now, driven.time = driven.clock.now + 0.05, driven.time + 0.05
        return shared.act(replace(driven.view(), grippers=grippers))

    for wanted, place, closed in ((1.0, 100.0, 1.0), (1.0, 0.0, 1.0), (1.0, 100.0, 0.0), (0.0, 0.0, 1.0)):
        policy.says = replace(rests, grippers=(wanted,))
        for moved in (100.0, 0.0, place):  # nothing counts that was undone before they go on
            assert act(moved) is EpisodeEvent.PAUSE
        driven.person.ask(Ask("start"))
        for _ in range(3):
            grippers = act(place).grippers
        assert grippers == (closed,)
        driven.person.ask(Ask("pause"))

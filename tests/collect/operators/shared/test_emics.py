"""The level of autonomy switches by the error of goal-directed motion, by the person, and by criticality."""

from itertools import pairwise

import numpy as np
import pytest
from arbiter_helpers import ONE, PERIOD, Course, arbiter, asks, channels_of

BOTH = ["emics", "hier_emics"]
RESTS, POLICY = asks("base", "ee", value=0.0), asks("base", "ee", value=0.1)
PUSHES, BACK = asks("base", value=0.2), asks("base", value=-0.2)
BASE = channels_of(ONE).base_slice


def drives(shares):
    """Return who does, of both by name."""
    return {(1.0, 0.0): "person", (0.0, 1.0): "policy", (0.0, 0.0): "nobody"}[
        float(shares.person[BASE][0]), float(shares.policy[BASE][0])
    ]


def swayed(course, seconds, policy=POLICY, **other):
    """Let a person push to and fro; return who drove when."""
    turns = ((BACK, PUSHES)[step % 2] for step in range(round(seconds / PERIOD)))
    return [drives(course.go(push, policy, **other)) for push in turns]


def switches(found):
    return sum(a != b for a, b in pairwise(found))


@pytest.mark.parametrize("size", [0.05, 0.1, 2.0, 1e6])
@pytest.mark.parametrize("made", [-0.5, 0.0, 0.4, 0.6, 1.0, 1.5])
@pytest.mark.parametrize("level", ["policy", "person"])
def test_a_driver_with_too_little_of_the_policy_s_way_loses_the_robot(level, made, size):
    """Whatever its size: E = 1 - made, and the threshold is 0.5."""
    policy, course = asks("base", "ee", value=size), Course(arbiter("emics", error=0.5))
    done = made * min(size, 1.0) * policy.mask  # of nine channels: a wish is cut to 3
    asked = PUSHES if level == "person" else RESTS
    course.go(asked, policy, realised=done)
    found = [drives(course.go(asked, policy, realised=done)) for _ in range(70)]
    loses = 1.0 - made > 0.5
    assert found[0] == level
    assert (level != found[-1]) == loses


def test_motion_that_leads_elsewhere_is_no_way():
    policy, course = asks("ee", value=0.1), Course(arbiter("emics"))
    aside = 0.5 * asks("base").mask
    aside[channels_of(ONE).hand_slice()] = [0.5, -0.5, 0.5, -0.5, 0.5, -0.5]
    assert drives(course.go(PUSHES, policy, realised=aside)) == "person"
    assert drives(course.go(PUSHES, policy, 5.0, realised=aside)) == "policy"


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_policy_that_wants_to_stand_takes_nothing(way):
    course = Course(arbiter("emics"))
    calm = asks("base", "ee", value=1e-3)
    assert set(swayed(course, 20.0, calm, realised=way * PUSHES.values)) == {"person"}


def test_a_policy_that_twitches_takes_nothing():
    course, still = Course(arbiter("emics")), asks("base", "ee", value=0.0)
    swayed(course, 5.0, still)
    assert set(swayed(course, PERIOD) + swayed(course, 1.0, still)) == {"person"}


def test_a_new_driver_is_judged_anew():
    """The policy failed, the person does well."""
    course = Course(arbiter("emics", window=2.0, dwell=0.5))
    while drives(course.go(RESTS, POLICY, realised=-POLICY.values)) == "policy":
        assert course.time < 1.0
    found = {drives(course.go(PUSHES, POLICY, realised=POLICY.values)) for _ in range(60)}
    assert found == {"person"}


def test_a_person_who_lets_go_gives_the_robot_back_by_and_by():
    course = Course(arbiter("emics", window=2.0, dwell=3.0))
    course.go(PUSHES, POLICY, 4.0, realised=POLICY.values)
    assert drives(course.go(RESTS, POLICY, 0.4)) == "person"
    assert drives(course.go(RESTS, POLICY, 0.6)) == "nobody"
    assert drives(course.go(RESTS, POLICY, 1.0)) == "policy"  # 1 - exp(-t / τ) > 0.5 after 1.4 s


@pytest.mark.parametrize("name", BOTH)
@pytest.mark.parametrize("dwell", [0.5, 3.0])
def test_the_switcher_switches_at_most_once_in_a_dwell_time(name, dwell):
    course = Course(arbiter(name, dwell=dwell, window=0.3))
    found = swayed(course, 20.0)
    assert 2 <= switches(found) <= 20.0 / dwell + 1


def test_a_person_takes_it_back_at_once_by_letting_go_and_pushing_again():
    course = Course(arbiter("emics"))
    found = swayed(course, 4.0)
    assert found[0] == "person"
    assert found[-1] == "policy"
    assert drives(course.go(PUSHES, POLICY)) == "policy", "that was pushed all the time"
    course.go(RESTS, POLICY)
    assert drives(course.go(PUSHES, POLICY)) == "person"


@pytest.mark.parametrize("name", BOTH)
def test_a_pause_is_no_error(name):
    course = Course(arbiter(name))
    course.go(RESTS, POLICY, 5.0, realised=POLICY.values)
    course.time += 60.0
    course.go(RESTS, None, 0.1)  # it plans anew
    assert drives(course.go(RESTS, POLICY, 0.3)) == "policy"


@pytest.mark.parametrize("name", BOTH)
def test_a_measurement_that_is_no_number_is_forgotten(name):
    course = Course(arbiter(name))
    course.go(RESTS, POLICY, 1.0, realised=np.full(len(RESTS.values), np.nan))
    assert drives(course.go(RESTS, POLICY, 5.0, realised=POLICY.values)) == "policy"
    assert drives(course.go(RESTS, POLICY, 2.0)) == "nobody"


@pytest.mark.parametrize("name", BOTH)
def test_without_a_usable_policy_the_person_drives_whoever_did(name):
    course = Course(arbiter(name))
    swayed(course, 4.0)
    assert drives(course.go(PUSHES, None, 1.1)) == "person"
    assert drives(course.go(RESTS, None, 5.0)) == "nobody"


@pytest.mark.parametrize("name", BOTH)
def test_a_policy_that_plans_anew_for_a_moment_has_the_robot_still(name):
    """As one beside the loop does at first, and whenever it gets the robot back."""
    course = Course(arbiter(name))
    course.go(RESTS, None, 0.1)
    assert drives(course.go(RESTS, POLICY)) == "policy"
    course.go(PUSHES, POLICY, 4.0)
    while drives(course.go(RESTS, POLICY)) != "policy":
        assert course.time < 20.0
    course.go(RESTS, None, 0.1)
    assert drives(course.go(RESTS, POLICY)) == "policy"


@pytest.mark.parametrize(("name", "loses"), [("emics", True), ("hier_emics", False)])
def test_a_person_with_a_purpose_keeps_the_robot_in_the_hierarchy(name, loses):
    """They go one way, and it is not the policy's."""
    course = Course(arbiter(name))
    found = [drives(course.go(PUSHES, POLICY)) for _ in range(600)]
    assert ("policy" in found) == loses


@pytest.mark.parametrize("name", BOTH)
def test_a_person_without_one_loses_it(name):
    assert "policy" in swayed(Course(arbiter(name)), 6.0)


def test_a_purpose_takes_the_robot_back_from_the_switcher():
    course = Course(arbiter("hier_emics"))
    assert swayed(course, 4.0)[-1] == "policy"
    assert drives(course.go(PUSHES, POLICY, 6.0)) == "person"


@pytest.mark.parametrize(("name", "given"), [("emics", True), ("hier_emics", False)])
def test_nobody_who_is_away_is_given_the_robot_in_the_hierarchy(name, given):
    """The policy makes its way until they are away, then none."""
    course = Course(arbiter(name, away=10.0))
    course.go(RESTS, POLICY, 12.0, realised=POLICY.values)
    found = [drives(course.go(RESTS, POLICY)) for _ in range(100)]
    assert ("nobody" in found) == given


@pytest.mark.parametrize("name", BOTH)
def test_one_who_was_there_a_moment_ago_is_given_it(name):
    course = Course(arbiter(name, away=10.0))
    course.go(RESTS, POLICY, 3.0, realised=POLICY.values)
    found = [drives(course.go(RESTS, POLICY)) for _ in range(100)]
    assert "nobody" in found


def test_an_absent_person_leaves_the_robot_to_a_policy_that_wants_to_stand():
    """There is no error then, and emics leaves it to nobody."""
    for name, last in (("emics", "nobody"), ("hier_emics", "policy")):
        course, calm = Course(arbiter(name, away=10.0)), asks("base", "ee", value=0.0)
        course.go(PUSHES, calm)
        assert drives(course.go(RESTS, calm, 12.0)) == last

"""Laws of the clutch: nothing jumps, the arm moves as the leader does, and never runs away from it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from handrail.collect.devices.follower import Clutch

LIMIT = np.array([1.0, 2.0, 3.0])
ANGLES = arrays(float, 3, elements=st.floats(-3.0, 3.0))
WITHIN = arrays(float, 3, elements=st.floats(-0.9, 0.9))


def clutch():
    return Clutch(-LIMIT, LIMIT)


@given(ANGLES, WITHIN)
def test_taking_hold_moves_nothing_wherever_both_are(leader, arm):
    made = clutch()
    assert made.targets(False, leader, arm) == ()
    assert made.targets(True, leader, arm) == pytest.approx(arm)


@given(ANGLES, WITHIN, arrays(float, (8, 3), elements=st.floats(-0.1, 0.1)))
def test_an_arm_that_keeps_up_moves_exactly_as_the_leader_does(leader, arm, steps):
    made, now, inside = clutch(), arm, True
    made.targets(True, leader, arm)
    for moved in np.cumsum(steps, axis=0):
        inside &= bool(np.all(np.abs(arm + moved) <= LIMIT))
        now = np.array(made.targets(True, leader + moved, now))
        assert not inside or now == pytest.approx(arm + moved)


@given(ANGLES, WITHIN, ANGLES, ANGLES)
def test_let_go_the_leader_can_be_put_anywhere(leader, arm, elsewhere, moved):
    made = clutch()
    made.targets(True, leader, arm)
    assert made.targets(False, elsewhere, arm) == ()
    assert made.targets(True, elsewhere + moved, arm) == pytest.approx(arm)


@given(ANGLES, WITHIN, arrays(float, (8, 3), elements=st.floats(-3.0, 3.0)))
def test_targets_are_never_far_ahead_nor_beyond_the_limits(leader, arm, places):
    made = clutch()
    made.targets(True, leader, arm)
    for place in places:
        targets = np.array(made.targets(True, place, arm))
        assert np.all(np.abs(targets - arm) <= 0.3 + 1e-12)
        assert np.all(np.abs(targets) <= LIMIT)


def test_excess_of_the_leader_is_forgotten():
    """An arm that stands still follows at once when the leader turns back."""
    made, arm = clutch(), np.zeros(3)
    made.targets(True, np.zeros(3), arm)
    assert made.targets(True, np.full(3, 2.0), arm) == pytest.approx([0.3] * 3)
    assert made.targets(True, np.full(3, 1.9), arm) == pytest.approx([0.2] * 3)

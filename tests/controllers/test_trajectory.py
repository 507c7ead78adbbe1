"""A trajectory's laws: the rest of it is the same curve; it leads where its velocities integrate to."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.trajectory import Trajectory

KNOTS = arrays(float, (6, 2), elements=st.floats(-2, 2))
PERIODS = st.lists(st.floats(0.0, 0.17), min_size=1, max_size=6)


def stopping(velocities, elapsed=0.0):
    return Trajectory(np.vstack([velocities, np.zeros((1, 2))]), 0.1, elapsed)


@pytest.mark.parametrize("dt", [0.0, -0.1, np.nan, np.inf])
def test_time_between_knots_is_some(dt):
    with pytest.raises(HandrailError, match="dt > 0"):
        Trajectory(np.ones((2, 2)), dt)


def test_after_all_time_it_is_at_rest():
    np.testing.assert_array_equal(Trajectory(np.ones((2, 2)), 0.1).velocity(np.inf), np.zeros(2))


@given(KNOTS, PERIODS, st.floats(0, 1))
def test_the_rest_of_a_plan_is_the_same_curve(velocities, periods, ahead):
    whole = left = stopping(velocities)
    for period in periods:
        left = left.after(period)
    np.testing.assert_allclose(left.velocity(ahead), whole.velocity(sum(periods) + ahead), atol=1e-7)


@given(KNOTS, st.floats(0.0, 0.25), st.integers(1, 3))
def test_a_path_is_the_integral_of_the_velocity(velocities, elapsed, samples):
    trajectory = stopping(velocities, elapsed)
    q, times = trajectory.path(np.ones(2), samples)
    assert times[0] == 0.0
    fine = np.linspace(0.0, times[-1], 2001)
    v = np.array([trajectory.velocity(time) for time in fine])
    moved = np.append(np.zeros((1, 2)), np.cumsum(0.5 * np.diff(fine)[:, None] * (v[1:] + v[:-1]), axis=0), 0)
    for time, position in zip(times, q, strict=True):
        np.testing.assert_allclose(position, 1.0 + moved[np.abs(fine - time).argmin()], atol=5e-3)


@given(KNOTS, st.floats(0.0, 0.25))
def test_accelerations_lead_from_knot_to_knot(velocities, elapsed):
    trajectory = stopping(velocities, elapsed)
    later = trajectory.after(0.7 * elapsed)
    np.testing.assert_allclose(trajectory.accelerations(8, 0.7 * elapsed), later.accelerations(8), atol=1e-9)
    accelerations = trajectory.accelerations(8)
    reached = trajectory.velocity(0.0) + 0.1 * np.cumsum(accelerations, axis=0)
    expected = [trajectory.velocity(0.1 * k) for k in range(1, 9)]
    np.testing.assert_allclose(reached, expected, atol=1e-7)


@pytest.mark.parametrize("shape", [(3,), (0, 2), (2, 2, 2)])
def test_velocities_without_knots_are_refused(shape):
    with pytest.raises(HandrailError, match="trajectory: expected velocities"):
        Trajectory(np.zeros(shape), 0.1)


def test_a_single_knot_is_held():
    np.testing.assert_array_equal(Trajectory(np.ones((1, 2)), 0.1).accelerations(3, 0.05), np.zeros((3, 2)))


def test_a_clock_that_leaps_very_far_finds_it_at_rest():
    left = Trajectory(np.zeros((3, 2)), 0.1).after(1e308)
    np.testing.assert_array_equal(left.velocity(0.0), np.zeros(2))

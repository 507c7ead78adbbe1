"""No command leaves the limits, whatever is asked."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.description import load_description
from handrail.controllers.safety.limiter import Limiter

DESCRIPTION = load_description("ridgeback_ur10")
LIMITS = DESCRIPTION.limits
LIMITER = Limiter(DESCRIPTION)
ANYTHING = arrays(float, 9, elements=st.floats(width=64))
INSIDE = arrays(float, 9, elements=st.floats(-1, 1)).map(lambda x: x * LIMITS.velocity)


@given(INSIDE, ANYTHING, st.floats(0.001, 0.2))
def test_velocity_and_acceleration_stay_inside(previous, target, duration):
    velocity, clipped = LIMITER.limit(previous, target, duration)
    assert np.all(np.abs(velocity) <= LIMITS.velocity + 1e-12)
    assert np.all(np.abs(velocity - previous) <= LIMITS.acceleration * duration + 1e-12)
    assert clipped or np.allclose(velocity, target, atol=1e-4)


@given(INSIDE, st.integers(0, 8), st.sampled_from([np.nan, np.inf, -np.inf]))
def test_nan_brakes_everything(previous, index, value):
    target = previous.copy()
    target[index] = value
    velocity, clipped = LIMITER.limit(previous, target, 0.05)
    assert clipped
    slower = np.maximum(np.abs(previous) - LIMITS.acceleration * 0.05, 0.0)
    np.testing.assert_allclose(velocity, np.sign(previous) * slower, atol=1e-12)


@given(INSIDE, arrays(float, 9, elements=st.floats(-5, 5)), st.sampled_from([0.02, 0.05, 0.1]))
def test_position_limits_are_never_passed(start, target, h):
    """Integrate a direct command into the limits: it stops before them."""
    v = np.zeros(9)
    q = np.clip(start * 3.0, LIMITS.position_lower + 0.1, LIMITS.position_upper - 0.1)
    for _ in range(400):
        after, _ = LIMITER.limit(v, target, h, q)
        q, v = q + h * 0.5 * (v + after), after
        slack = LIMITS.acceleration * h**2 / 8.0 + 1e-9
        assert np.all(q <= LIMITS.position_upper + slack)
        assert np.all(q >= LIMITS.position_lower - slack)


def test_a_target_of_the_wrong_size_brakes():
    previous = 0.5 * LIMITS.velocity
    velocity, clipped = LIMITER.limit(previous, np.ones(3), 0.05)
    assert clipped
    assert np.all(np.abs(velocity) < np.abs(previous))


@pytest.mark.parametrize("last", [np.ones(4), np.full(9, np.nan), np.full(9, np.inf)])
def test_a_stop_from_nonsense_is_refused(last):
    with pytest.raises(HandrailError, match="velocity to stop from"):
        LIMITER.to_rest(last[None], 0.1)


@given(INSIDE)
def test_braking_is_the_fastest_stop(velocity):
    braking = LIMITER.to_rest(velocity[None], 0.1)
    times = 0.1 * np.arange(len(braking))[:, None]
    slower = np.maximum(np.abs(velocity) - LIMITS.acceleration * times, 0.0)
    np.testing.assert_allclose(braking, np.sign(velocity) * slower, atol=1e-9)
    np.testing.assert_allclose(braking[-1], 0.0)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_position_that_is_no_number_brakes(wrong):
    """And the velocity stays a number: the next command begins from it."""
    previous, step = 0.5 * LIMITER.limits.velocity, LIMITER.limits.acceleration * 0.05
    velocity, clipped = LIMITER.limit(previous, previous, 0.05, np.full(len(previous), wrong))
    assert clipped
    np.testing.assert_allclose(velocity, np.maximum(previous - step, 0.0))

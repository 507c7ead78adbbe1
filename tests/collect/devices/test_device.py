"""Laws of a stick's shape: nothing near the middle, odd, never turning back, full at the end."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handrail.collect.devices.device import StickShape

SHAPES = st.builds(StickShape, st.floats(0.0, 0.5), st.floats(1.0, 3.0))


@given(SHAPES, st.floats(-1.0, 1.0))
def test_nothing_moves_within_the_dead_zone_and_all_else_the_right_way(shape, raw):
    assert shape(raw) == 0.0 if abs(raw) <= shape.dead_zone else shape(raw) * raw >= 0.0
    assert shape(-raw) == -shape(raw)
    assert abs(shape(raw)) <= 1.0


@given(SHAPES, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_farther_is_never_less(shape, one, other):
    assert (shape(one) <= shape(other)) or one > other


def test_the_curve_is_that_of_its_equation():
    """Golden: ((0.6 − 0.2) / 0.8)² = 1/4."""
    assert StickShape(0.2, 2.0)(0.6) == pytest.approx(0.25)
    assert StickShape(0.0, 1.0)(-0.3) == pytest.approx(-0.3)


@given(SHAPES)
def test_full_is_full_and_garbage_is_nothing(shape):
    assert shape(1.0) == shape(7.0) == 1.0
    assert shape(math.nan) == 0.0

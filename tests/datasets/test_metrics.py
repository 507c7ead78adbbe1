"""Smoothness has golden values and is blind to what it should be blind to."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handrail.datasets.quality.metrics import (
    corrections,
    high_frequency_content,
    ldlj,
    path_length,
    rate_of_change,
    sparc,
)
from handrail.datasets.quality.motion import gripper_state

BELL = np.exp(-5 * np.arange(-1, 1, 0.01) ** 2)


def _minimum_jerk(parts: int, fs: float = 50.0) -> np.ndarray:
    """Return the speed of submovements one after the other, 1 s each."""
    time = np.arange(0, 1, 1 / fs)
    return np.tile(30 * time**2 - 60 * time**3 + 30 * time**4, parts)


def test_golden_values():
    assert sparc(BELL, 100.0) == pytest.approx(-1.41403, abs=1e-5)
    assert ldlj(BELL, 100.0) == pytest.approx(-5.81636, abs=1e-5)
    assert sparc(_minimum_jerk(1), 50.0) == pytest.approx(-1.41, abs=0.02)


def test_more_submovements_are_less_smooth():
    for measure in (sparc, ldlj):
        values = [measure(_minimum_jerk(parts), 50.0) for parts in (1, 2, 4, 8)]
        assert values == sorted(values, reverse=True)


def test_jerk_falls_with_the_logarithm_of_the_submovements():
    two, eight = ldlj(_minimum_jerk(2), 50.0), ldlj(_minimum_jerk(8), 50.0)
    assert two - eight == pytest.approx(4 * np.log(4), abs=0.1)


@given(st.floats(1e-3, 1e3))
def test_scale_does_not_matter(scale):
    assert sparc(scale * BELL, 100.0) == pytest.approx(sparc(BELL, 100.0), rel=1e-9)
    assert ldlj(scale * BELL, 100.0) == pytest.approx(ldlj(BELL, 100.0), rel=1e-9)


@pytest.mark.parametrize("speed", [[], [1.0], np.zeros(50), np.full(9, np.nan)])
def test_no_motion_has_no_smoothness(speed):
    assert np.isnan(sparc(np.asarray(speed), 50.0))
    assert np.isnan(ldlj(np.asarray(speed), 50.0))


def test_an_even_motion_has_no_smoothness_but_its_rounding():
    places = np.float32(0.1) * np.arange(99, dtype=np.float32)
    assert np.isnan(ldlj(np.abs(np.diff(places)).astype(float) * 20.0, 20.0))


def test_path_length():
    angle = np.linspace(0, 2 * np.pi, 1001)
    assert path_length(np.column_stack([np.cos(angle), np.sin(angle)])) == pytest.approx(2 * np.pi, rel=1e-4)
    assert path_length(np.zeros((1, 3))) == 0.0


TIMES = np.arange(200) / 50.0  # 4 s at 50 Hz


def test_chattering_golden_values():
    vibration = 0.3 * np.sin(2 * np.pi * 5.0 * TIMES) + 0.2 * np.cos(2 * np.pi * 2.0 * TIMES) + 7.0
    assert high_frequency_content(vibration[:, None], 50.0) == pytest.approx(0.3 * 5.0 + 0.2 * 2.0)
    both = np.column_stack([vibration, 2.0 * vibration])
    assert high_frequency_content(both, 50.0) == pytest.approx(3.0 * (0.3 * 5.0 + 0.2 * 2.0))
    ramp = np.column_stack([3.0 * TIMES, -4.0 * TIMES])
    assert rate_of_change(ramp, 50.0) == pytest.approx(5.0)
    bang = np.array([[1.0], [1.0], [-1.0], [-1.0], [1.0]])
    assert rate_of_change(bang, 10.0) == pytest.approx(20.0 * np.sqrt(2 / 4))


@given(st.integers(1, 6), st.floats(0.1, 10.0))
def test_chattering_grows_with_frequency_and_amplitude(cycles, scale):
    slow, fast = (np.sin(2 * np.pi * k * TIMES / 4.0)[:, None] for k in (cycles, 2 * cycles))
    for measure in (rate_of_change, high_frequency_content):
        assert measure(fast, 50.0) > 1.9 * measure(slow, 50.0)
        assert measure(scale * slow, 50.0) == pytest.approx(scale * measure(slow, 50.0))


def test_corrections_are_counted_when_they_switch():
    asked = np.zeros((8, 2))
    commanded = np.array([[0, 0], [0.5, 0], [0.5, 0.2], [0, 0.2], [0, 0.009], [0, 0], [0, -0.02], [0, 0]])
    owned = np.ones((8, 2), bool)
    assert corrections(asked, commanded, owned) == 4  # on, off, on, off
    assert corrections(asked, commanded, owned, tolerance=0.3) == 2
    assert corrections(asked, commanded, owned & [False, True]) == 4
    assert corrections(asked, commanded, owned & False) == 0
    assert corrections(asked[:3], commanded[:3], owned[:3]) == 1  # the end switches nothing off
    assert corrections(asked[1:3], commanded[1:3], owned[1:3]) == 1  # and before the beginning it is off
    assert corrections(asked, asked + 0.009, owned) == 0


@pytest.mark.parametrize("command", [np.zeros((0, 3)), np.zeros((1, 3)), np.full((9, 3), np.nan)])
def test_columns_that_are_no_command_have_no_chattering(command):
    assert np.isnan(rate_of_change(command, 50.0))
    assert np.isnan(high_frequency_content(command, 50.0))


@pytest.mark.parametrize("fs", [5.0, 8.0, 10.0, 15.0, 20.0, 100.0])
def test_smoothness_does_not_hang_on_the_frame_rate(fs):
    time = np.arange(0, 1, 1 / (4 * fs))
    assert sparc(30 * time**2 - 60 * time**3 + 30 * time**4, fs) == pytest.approx(-1.41, abs=0.05)


@pytest.mark.parametrize("scale", [1.0, 100.0])  # of an opening in percent, as LeRobot's
def test_a_gripper_that_trembles_does_not_open_or_close(scale):
    noise = np.random.default_rng(0).uniform(-1e-3, 1e-3, 300)
    held, closing = np.full(300, 0.6), np.where(np.arange(300) < 100, 0.9, 0.1)
    for still in held, held / 30, 0 * held:
        assert not np.diff(gripper_state(scale * (still + noise), 0.9 * scale)).any()
    assert np.flatnonzero(np.diff(gripper_state(scale * (closing + noise), 0.9 * scale))).tolist() == [99]

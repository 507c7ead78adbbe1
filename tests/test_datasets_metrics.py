"""Smoothness has golden values and is blind to what it should be blind to."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handrail.controllers.errors import HandrailError
from handrail.datasets.metrics import ldlj, path_length, sparc

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


def test_wrong_arguments():
    with pytest.raises(HandrailError, match="shape"):
        sparc(np.zeros((3, 2)), 50.0)
    with pytest.raises(HandrailError, match="positive rate"):
        ldlj(BELL, 0.0)


def test_path_length():
    angle = np.linspace(0, 2 * np.pi, 1001)
    assert path_length(np.column_stack([np.cos(angle), np.sin(angle)])) == pytest.approx(2 * np.pi, rel=1e-4)
    assert path_length(np.zeros((1, 3))) == 0.0

"""Laws of the paired statistics."""

import numpy as np
import pytest

from handrail.controllers.errors import HandrailError
from handrail.datasets.statistics.paired import paired_difference, paired_success, wilson

RNG = np.random.default_rng


def test_a_known_difference():
    """Golden: differences 1 … 5 have mean 3, t half-width 2.776 · 1.5811 / √5 = 1.963, Wilcoxon p 1/16."""
    second = np.array([4.0, 1.0, 7.0, 2.0, 9.0])
    found = paired_difference(second + np.arange(1, 6), second, RNG(0))
    assert found.pairs == 5
    assert found.mean == pytest.approx(3.0)
    assert found.t_interval == pytest.approx((3.0 - 1.96324, 3.0 + 1.96324), abs=1e-4)
    assert found.p_wilcoxon == pytest.approx(0.0625)
    assert 1.0 <= found.bootstrap_interval[0] < 3.0 < found.bootstrap_interval[1] <= 5.0


def test_swapping_turns_the_sign():
    a, b = RNG(1).normal(0.3, 1.0, 40), RNG(2).normal(0.0, 1.0, 40)
    one, other = paired_difference(a, b, RNG(3)), paired_difference(b, a, RNG(3))
    assert one.mean == pytest.approx(-other.mean)
    assert one.t_interval == pytest.approx((-other.t_interval[1], -other.t_interval[0]))
    assert one.p_wilcoxon == pytest.approx(other.p_wilcoxon)


def test_intervals_cover_the_truth_about_as_often_as_they_say():
    """Over 300 draws with a true mean of 0.5: both intervals cover it in 90 to 99 %."""
    covered = np.zeros(2)
    for seed in range(300):
        a = RNG(seed).normal(0.5, 1.0, 30)
        found = paired_difference(a, np.zeros(30), RNG(seed))
        for index, (low, high) in enumerate((found.t_interval, found.bootstrap_interval)):
            covered[index] += low <= 0.5 <= high
    assert np.all((covered > 0.90 * 300) & (covered < 0.99 * 300))


def test_pairs_without_a_number_are_left_out():
    a = np.array([1.0, np.nan, 3.0, 4.0, np.inf])
    found = paired_difference(a, np.zeros(5), RNG(0))
    assert found.pairs == 3
    assert found.mean == pytest.approx(8.0 / 3.0)


def test_no_difference_is_no_evidence():
    found = paired_difference(np.ones(9), np.ones(9), RNG(0))
    assert (found.mean, found.p_wilcoxon, found.bootstrap_interval) == (0.0, 1.0, (0.0, 0.0))


def test_mcnemar():
    """Golden: 8 against 1 discordant pairs, two-sided exact p = 2 · 10 / 512."""
    first = np.array([1] * 8 + [0] + [1] * 11)
    second = np.array([0] * 8 + [1] + [1] * 11)
    found = paired_success(first, second)
    assert (found.pairs, found.only_first, found.only_second) == (20, 8, 1)
    assert found.p_mcnemar == pytest.approx(20 / 512)
    assert paired_success(first, first).p_mcnemar == 1.0


def test_wilson():
    """Golden: 97 of 100 (Wilson 1927, z = 1.96): 0.9155 to 0.9897; never outside [0, 1]."""
    assert wilson(97, 100) == pytest.approx((0.9155, 0.9897), abs=1e-4)
    assert wilson(0, 10)[0] == 0.0
    assert wilson(10, 10)[1] == 1.0


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: paired_difference(np.ones(3), np.ones(4), RNG(0)), "expected equal sizes, got 3 and 4"),
        (lambda: paired_difference(np.ones(1), np.ones(1), RNG(0)), "expected two pairs or more, got 1"),
        (lambda: paired_success(np.ones(0), np.ones(0)), "expected equal sizes, got 0 and 0"),
        (lambda: wilson(3, 2), "got 3 of 2"),
    ],
)
def test_wrong_input_is_named(call, words):
    with pytest.raises(HandrailError, match=words):
        call()

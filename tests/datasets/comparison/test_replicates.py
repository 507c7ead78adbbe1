"""A handful of trained policies is a handful: no test of them is ever sure, and their scenes count once."""

import numpy as np
import pytest
from compare_helpers import condition, judge
from scipy import stats

from handrail.datasets.statistics.paired import paired_success
from handrail.datasets.statistics.proportions import mcnemar_by_scene, paired_shares
from handrail.datasets.statistics.replicates import (
    chance_of_means,
    replicates,
    standard_error,
    t_interval,
    welch_p,
)
from handrail.datasets.statistics.resampling import Run


def rng(*seed):
    return np.random.default_rng(seed)


def runs(shares, rollouts=100, draws=None):
    """Policies that succeed exactly as often as is said, in scenes that differ from policy to policy."""
    found = []
    for place, share in enumerate(shares):
        values = np.zeros(rollouts)
        values[: round(share * rollouts)] = 1.0
        draw = draws[place] if draws else 0
        found.append(Run(draw, place, tuple(range(rollouts)), rng(place).permutation(values)))
    return found


def test_welch_knows_how_few_training_seeds_there_are():
    """Golden: shares 0.8, 0.6 against 0.4, 0.2: t = 0.4 / √0.02, two degrees of freedom, p = 0.1056."""
    assert welch_p(runs([0.8, 0.6]), runs([0.4, 0.2])) == pytest.approx(0.1056, abs=1e-4)


def test_policies_that_agree_by_chance_are_not_certain():
    """Three shares of 10 rollouts that are equal still vary as rollouts do; p was 0 here."""
    few, more = runs([0.1] * 3, 10), runs([0.2] * 3, 10)
    assert welch_p(few, few) == 1.0
    assert 0.2 < welch_p(few, more) < 0.9
    error, freedom = standard_error((few, more))
    chance = [(k + 2) / 34 * (1 - (k + 2) / 34) / 10 for k in (3, 6)]
    assert error == pytest.approx(np.sqrt(sum(chance) / 3))
    assert 2.0 < freedom <= 4.0
    assert 0.0 < welch_p(runs([1.0] * 3), runs([0.0] * 3)) < 1e-4


def test_a_draw_of_the_dataset_is_one_replicate():
    """Three policies of one recording and three of another: two numbers, one degree of freedom."""
    found = runs([0.9, 0.8, 1.0, 0.4, 0.5, 0.3], draws=[0, 0, 0, 1, 1, 1])
    assert replicates(found) == pytest.approx([0.9, 0.4])
    assert standard_error([found]) == pytest.approx((np.sqrt(0.125 / 2), 1.0))
    assert replicates(found[:3]) == pytest.approx([0.9, 0.8, 1.0])


def test_intervals_over_three_seeds_are_as_wide_as_t():
    """Resampling three numbers never leaves their range; Student's interval of three is 4.3 errors wide."""
    shares = {"a": [0.9, 0.7, 0.5], "b": [0.4, 0.3, 0.2]}
    found = judge({label: condition(label, runs(each)) for label, each in shares.items()}, "b", rng(0))
    error, freedom = found.differences[0].errors[-1]
    low, high = t_interval(0.4, error, freedom)
    assert found.differences[0].nested == pytest.approx((low, high), abs=1e-6)
    assert high - low == pytest.approx(2 * stats.t.ppf(0.975, freedom) * error)
    assert found.successes["a"].nested == pytest.approx((0.7 - 4.3027 * 0.2 / np.sqrt(3), 1.0), abs=1e-4)


def test_an_interval_over_three_seeds_covers():
    """Of 200 conditions of three policies that differ by luck, 95 % of the intervals hold the truth."""
    generator, covered = rng(1), 0
    for _ in range(200):
        shares = np.clip(0.5 + 0.15 * generator.normal(size=3), 0.0, 1.0)
        values = [(generator.random(50) < share).astype(float) for share in shares]
        found = [Run(0, place, tuple(range(50)), each) for place, each in enumerate(values)]
        found = judge({"a": condition("a", found)}, "a", generator).successes["a"]
        covered += found.nested[0] <= 0.5 <= found.nested[1]
    assert covered >= 182


def test_a_mean_that_never_varies_has_no_error():
    still = [Run(0, seed, (0, 1), np.zeros(2)) for seed in range(3)]
    assert standard_error([still], chance_of_means) == (0.0, float("inf"))


def test_mcnemar_by_scene_is_mcnemar_where_no_scene_repeats():
    one, other = rng(2).random(60) < 0.7, rng(3).random(60) < 0.4
    assert mcnemar_by_scene(one.astype(int) - other, range(60)) == pytest.approx(
        paired_success(one, other).p_mcnemar
    )
    assert mcnemar_by_scene(np.zeros(5, int), range(5)) == 1.0


def test_scenes_that_repeat_do_not_make_chance_a_difference():
    """Conditions that are the same, three policies in 30 scenes of which each condition likes half."""
    generator, seen, naive = rng(4), 0, 0
    for _ in range(200):
        liked = generator.random(30) < 0.5
        one, other = (np.tile(generator.random(30) < np.where(side, 0.9, 0.1), 3) for side in (liked, ~liked))
        seen += paired_shares(one, other, [*range(30)] * 3).p < 0.05
        naive += paired_shares(one, other).p < 0.05
    assert seen <= 16
    assert naive > 40

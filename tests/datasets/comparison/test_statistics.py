"""The statistics of a comparison: published values, and that chance is not taken for a difference."""

import json
from typing import Any

import numpy as np
import pytest
from compare_helpers import condition, judge
from scipy.stats import fisher_exact

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.episodes import at_equal_length
from handrail.datasets.comparison.evaluations import FORMAT, read_evaluations
from handrail.datasets.comparison.report import sentence
from handrail.datasets.statistics.contrast import holm
from handrail.datasets.statistics.proportions import (
    newcombe,
    newcombe_paired,
    paired_shares,
    unpaired_shares,
)
from handrail.datasets.statistics.resampling import (
    Run,
    bootstrap_mean,
    difference_of_means,
    permutation_p,
    resample_runs,
)

# Newcombe 1998, Statistics in Medicine 17, 2635–2650, table III, method 10
TABLE_III = {
    (36, 12, 2, 0): (0.0569, 0.3404),
    (20, 12, 2, 16): (0.0562, 0.3292),
    (18, 12, 2, 18): (0.0562, 0.3290),
    (36, 14, 0, 0): (0.1528, 0.4167),
    (35, 14, 0, 1): (0.1461, 0.4175),
    (2, 97, 1, 0): (0.8721, 0.9854),
    (54, 0, 0, 0): (-0.0664, 0.0664),
    (30, 0, 0, 24): (-0.0358, 0.0358),
}


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.mark.parametrize(("cells", "interval"), TABLE_III.items())
def test_paired_interval_is_newcombe_s(cells, interval):
    assert newcombe_paired(*cells) == pytest.approx(interval, abs=5e-5)
    both, first, second, neither = cells
    swapped = newcombe_paired(both, second, first, neither)
    assert (-swapped[1], -swapped[0]) == pytest.approx(interval, abs=5e-5)


def test_unpaired_interval_is_newcombe_s():
    """Golden: 56 of 70 against 48 of 80, Newcombe 1998, 873–890, table II, method 10."""
    assert newcombe((56, 70), (48, 80)) == pytest.approx((0.0524, 0.3339), abs=5e-5)


def test_holm():
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.9, 0.8]) == [1.0, 1.0]
    assert holm([]) == []


def test_boschloo_is_symmetric_and_sees_more_than_fisher():
    """7 of 12 against 1 of 12: uniformly more powerful than Fisher's test."""
    found = unpaired_shares([True] * 7 + [False] * 5, [True] + [False] * 11)
    swapped = unpaired_shares([True] + [False] * 11, [True] * 7 + [False] * 5)
    assert (found.paired, found.counts) == (False, (12, 12))
    assert found.estimate == pytest.approx(0.5)
    assert swapped.p == pytest.approx(found.p)
    assert 0.005 < found.p < float(np.asarray(fisher_exact([[7, 1], [5, 11]]))[1])


def test_the_detectable_difference_shrinks_with_the_root_of_the_trials():
    few, many = (unpaired_shares([True, False] * n, [True, False] * n) for n in (10, 40))
    assert few.detectable() == pytest.approx(2.8016 * np.sqrt(0.5 / 20), rel=1e-3)
    assert many.detectable() == pytest.approx(0.5 * few.detectable(), rel=1e-3)
    assert many.detectable(9) == pytest.approx((2.7730 + 0.8416) / 2.8016 * many.detectable(), rel=1e-3)


def test_the_interval_of_a_mean():
    values = rng().normal(size=400)
    half = 1.96 * values.std() / 20.0
    expected = values.mean() - half, values.mean() + half
    assert bootstrap_mean(values, rng()) == pytest.approx(expected, abs=0.01)


def test_permutation_p():
    same = rng().normal(size=30)
    assert permutation_p((same, same), difference_of_means, True, rng()) == 1.0
    assert permutation_p((same + 5.0, same), difference_of_means, True, rng()) < 0.001
    assert permutation_p((same + 5.0, same[:20]), difference_of_means, False, rng()) < 0.001
    draws = [rng(seed).normal(size=(2, 20)) for seed in range(100)]
    values = [
        permutation_p((draw[0], draw[1]), difference_of_means, False, rng(seed))
        for seed, draw in enumerate(draws)
    ]
    assert np.sum(np.array(values) < 0.05) <= 12
    assert 0.35 < np.mean(values) < 0.65


def test_the_p_of_a_few_values_counts_every_permutation():
    low, high = np.arange(4.0), np.arange(4.0) + 10.0
    for seed in range(3):
        for paired, count in ((False, 70), (True, 16)):  # 8 over 4, and signs of 4
            found = permutation_p((low, high), difference_of_means, paired, rng(seed))
            assert found == pytest.approx(2 / count)


def test_differences_at_equal_length():
    """Golden: y = 3 L + 5 [group], exactly: 5, whatever the lengths are."""
    lengths = rng().uniform(1.0, 9.0, size=(2, 1, 30)) + np.array([4.0, 0.0])[:, None, None]
    values = 3.0 * lengths + np.array([5.0, 0.0])[:, None, None]
    assert at_equal_length(list(values), list(lengths)) == pytest.approx([5.0])
    assert at_equal_length(list(values), [np.ones((1, 30))] * 2) == pytest.approx(
        values[0].mean() - values[1].mean()
    )


def runs(shares, seeds=100, generator=None, draws=1):
    generator = generator or rng()
    return [
        Run(place % draws, place, tuple(range(seeds)), (generator.random(seeds) < share).astype(float))
        for place, share in enumerate(shares)
    ]


def test_runs_of_one_policy_vary_as_their_rollouts_do():
    """Golden: four runs that are the same rollouts have the binomial standard error of one."""
    (run,) = runs([0.5])
    (means,) = resample_runs([[Run(0, seed, run.seeds, run.values) for seed in range(4)]], rng())
    share = run.values.mean()
    assert means.std() == pytest.approx(np.sqrt(share * (1 - share) / 100), rel=0.06)


def test_training_seeds_widen_the_interval():
    alike, apart = (resample_runs([runs(s, 200)], rng())[0] for s in ([0.5] * 4, [0.2, 0.4, 0.6, 0.8]))
    assert apart.std() > 2.0 * alike.std()
    between = [resample_runs([runs([0.2, 0.2, 0.8, 0.8], 200, draws=d)], rng())[0].std() for d in (1, 2)]
    assert min(between) > 0.05


def test_pairs_stay_paired():
    same = runs([0.5])
    one, other = resample_runs([same, same], rng())
    assert np.array_equal(one, other)


def judged(**shares):
    """Return the differences of conditions from `a`, whose policies succeed in about such shares."""
    found = {
        x: condition(x, runs(each, generator=rng(k)), True) for k, (x, each) in enumerate(shares.items())
    }
    return judge(found, "a", rng())


def test_a_clear_difference_is_detected_and_chance_is_not():
    outcomes = judged(a=[0.9] * 4, b=[0.5] * 4, c=[0.88] * 4)
    clear, none = outcomes.differences
    assert (clear.label, clear.detected, none.label, none.detected) == ("b", True, "c", False)
    assert clear.paired
    assert clear.nested[1] < 0
    assert clear.p <= clear.p_adjusted
    assert outcomes.values[1].measure.name == "contacts"
    assert outcomes.values[1].estimate == pytest.approx(0.5)


def test_training_seeds_are_not_taken_for_a_difference_of_data():
    """Two conditions that differ by training seeds alone: rollouts alone mostly see a difference."""
    nested = rollouts = 0
    for seed in range(25):
        generator = rng(seed)
        drawn = {label: generator.uniform(0.3, 0.9, size=5) for label in "ab"}
        both = {label: runs(shares, 200, generator) for label, shares in drawn.items()}
        outcome = judge({label: condition(label, each) for label, each in both.items()}, "a", generator)
        (difference,) = outcome.differences
        low, high = difference.interval or (np.nan, np.nan)
        rollouts += not low <= 0 <= high
        nested += difference.detected
    assert rollouts > 9
    assert nested <= 4


def test_one_training_seed_says_nothing_of_training():
    outcomes = judged(a=[0.9], b=[0.5])
    (difference,) = outcomes.differences
    assert difference.nested is None
    assert outcomes.successes["a"].nested is None


@pytest.mark.parametrize("shares", [{"a": [0.9], "b": [0.5]}, {"a": [0.9] * 5, "b": [0.5]}])
def test_one_training_seed_claims_no_difference(shares):
    """Trainings differ by 10 to 15 points by chance: with one policy nothing tells that apart from data."""
    (difference,) = judged(**shares).differences
    assert difference.estimate == pytest.approx(-0.4, abs=0.05)
    assert not difference.detected
    assert (difference.p, difference.seen) == (None, None)
    told = sentence(difference, "Success")
    assert told.endswith("not tested: one policy of a condition says nothing of other trainings.")


GOOD = {"training_seed": 0, "rollouts": [{"seed": 1, "success": True}]}
WRONG = [
    (None, {"a": [GOOD]}, "expected the format 'handrail.evaluations/1', got None"),
    (FORMAT, {}, "expected 'arms' with one label or more"),
    (FORMAT, {"a": [GOOD | {"rollouts": []}]}, "condition 'a': expected a list of length >= 1 at .*rollouts"),
    (FORMAT, {"a": [GOOD | {"rollouts": [{"seed": 1, "success": 0.5}]}]}, "expected true or false at .succ"),
    (FORMAT, {"a": [GOOD, GOOD]}, "training seed 0: the rollout with seed 1 comes twice"),
]


@pytest.mark.parametrize(("said", "arms", "message"), WRONG)
def test_wrong_evaluations(tmp_path, said, arms, message):
    path = tmp_path / "wrong.json"
    path.write_text(json.dumps({"format": said, "arms": arms}))
    with pytest.raises(HandrailError, match=message):
        read_evaluations([path])


def evaluated(path, seeds, training_seed=0, checkpoint="", **said):
    """Write an evaluation file of one policy."""
    policy = {"training_seed": training_seed, "rollouts": [{"seed": seed, "success": True} for seed in seeds]}
    policy |= {"checkpoint": checkpoint} if checkpoint else {}
    path.write_text(json.dumps({"format": FORMAT, **said, "arms": {"ee": [policy]}}))
    return path


def test_files_add_up_only_where_they_are_of_the_same(tmp_path):
    under = {"ee": {"protection": "none", "time_limit": "30"}}
    one = evaluated(tmp_path / "a", range(5), checkpoint="X", task="reach", conditions=under)
    plain = evaluated(tmp_path / "b", range(5, 9))  # of a program that says no more
    (condition,) = read_evaluations([one, plain]).values()
    assert len(condition.rollouts) == 9
    mpc = {"ee": {"protection": "mpc", "time_limit": "30"}}
    for words, others in (
        ("expected task 'reach' as before, got 'tray'", {"training_seed": 1, "task": "tray"}),
        ("expected protection 'none' as before, got 'mpc'", {"training_seed": 1, "conditions": mpc}),
        ("expected checkpoint of draw 0, training seed 0 'X' as before, got 'Y'", {"checkpoint": "Y"}),
        ("conditions: expected", {"conditions": ["ee"]}),
    ):
        other = evaluated(tmp_path / "c", range(5, 9), **others)
        with pytest.raises(HandrailError, match=words):
            read_evaluations([one, other])


def test_ten_thousand_long_rollouts_can_be_read_again(tmp_path):
    row = {"success": False, "distances": [0.123] * 120}
    policy = {"training_seed": 0, "rollouts": [{"seed": seed} | row for seed in range(10_000)]}
    path = tmp_path / "e.json"
    path.write_text(json.dumps({"format": FORMAT, "arms": {"ee": [policy]}}, indent=1))
    (condition,) = read_evaluations([path]).values()
    assert len(condition.rollouts) == 10_000


def test_thousands_of_trials_are_compared_by_a_test_that_takes_no_minutes(monkeypatch):
    monkeypatch.setattr("scipy.stats.boschloo_exact", pytest.fail)
    many = unpaired_shares([True] * 900 + [False] * 1100, [True] * 1000 + [False] * 1000)
    exact: Any = fisher_exact([[900, 1000], [1100, 1000]])
    assert many.p == pytest.approx(exact.pvalue)


@pytest.mark.parametrize("share", [1.0, 0.96])
@pytest.mark.parametrize("paired", [True, False])
def test_the_detectable_difference_is_detected_where_nearly_all_succeed(share, paired):
    """80 % of experiments are claimed; where both always succeeded, 17 % of 3.9 points would be seen."""
    compare, count, generator = (paired_shares if paired else unpaired_shares), 100, rng(5)
    always = np.arange(count) < share * count
    apart = compare(always, always).detectable()
    seen = 0
    for _ in range(100):
        one = generator.random(count) < share
        other = one & (generator.random(count) > apart / share)
        seen += compare(one, other if paired else generator.permutation(other)).p < 0.05
    assert 70 <= seen <= 100

"""Which metric predicts success: with cells of which it is known."""

import numpy as np
import pytest

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.prediction import PolicyCell, predictions
from handrail.datasets.comparison.report.prediction import prediction_table, prediction_words
from handrail.datasets.statistics.ranks import rank_correlation

TASKS = {"reach": 0.9, "pick_place": 0.4}


def cells(modes=6, draws=6, seed=0):
    """Return cells in which `mode` and `recording` decide, and neither `noise` nor what tasks differ in."""
    rng = np.random.default_rng(seed)
    found = []
    for task, ease in TASKS.items():
        for mode in range(modes):
            for draw in range(draws):
                luck = rng.normal()
                metrics = {
                    "mode": mode + 0.1 * rng.normal() - 20.0 * ease,
                    "recording": luck + 0.3 * rng.normal(),
                    "noise": rng.normal(),
                    "task": 100.0 * ease + rng.normal(),
                    "sparc": -float(mode) + 0.1 * rng.normal(),
                    "lacking": None if mode else 1.0,
                }
                success = ease + 0.05 * mode + 0.01 * luck
                found.append(PolicyCell(task, str(mode), draw, success, metrics))
    return found


def judged(*args, **options):
    return {each.metric: each for each in predictions(cells(*args, **options), np.random.default_rng(1))}


def test_what_decides_is_found_and_what_does_not_is_not(few_resamples):
    found = judged()
    assert found["mode"].between_detected
    assert found["recording"].within_detected
    assert found["recording"].within.estimate > 0.8
    for name in ("noise", "task"):
        assert not found[name].detected


def test_tasks_are_not_mistaken_for_prediction():
    """Over both tasks at once the ranks agree wholly, since one is easier; within each there is nothing."""
    rng = np.random.default_rng(2)
    task = np.repeat([0, 1], 20)
    metric, success = (10.0 * task + rng.normal(size=40) for _ in range(2))
    pooled = rank_correlation(metric, success, task.tolist(), range(40), rng)
    naive = rank_correlation(metric, success, [0] * 40, range(40), rng)
    assert naive.interval[0] > 0.5
    assert pooled.interval[0] < 0.0 < pooled.interval[1]


@pytest.mark.parametrize("units", [3, 4, 6])
def test_few_units_have_wide_intervals_even_if_they_agree_wholly(units):
    values = np.arange(float(units))
    found = rank_correlation(values, values, ["one"] * units, range(units), np.random.default_rng(0))
    assert found.estimate == pytest.approx(1.0)
    assert found.interval[1] - found.interval[0] > 0.5
    assert found.interval[0] <= found.estimate <= found.interval[1]
    assert found.p > 0.8 * found.least_p


def test_more_units_narrow_it_and_chance_rarely_detects(few_resamples):
    rng = np.random.default_rng(4)
    widths, detected = [], 0
    for count in (8, 80):
        x = rng.normal(size=count)
        low, high = rank_correlation(x, x + rng.normal(size=count), [0] * count, range(count), rng).interval
        widths.append(high - low)
    for _ in range(40):
        found = rank_correlation(rng.normal(size=8), rng.normal(size=8), [0] * 4 + [1] * 4, range(8), rng)
        detected += found.p < 0.05 and not found.interval[0] <= 0.0 <= found.interval[1]
    assert widths[1] < 0.6 * widths[0]
    assert detected <= 5


def test_what_blocks_share_is_not_mistaken_for_many_agreements(few_resamples):
    """Persons make some draws slow and, by chance, easy or hard, in all modes alike: eight facts, not 64."""
    rng, blocks, strata = np.random.default_rng(6), np.tile(np.arange(8), 8), np.repeat(np.arange(8), 8)
    shuffled, together, apart = rng.permutation(64), 0, 0
    for _ in range(40):
        metric, success = (rng.normal(size=8)[blocks] + 0.3 * rng.normal(size=64) for _ in range(2))
        sides = metric[shuffled], success[shuffled], strata[shuffled].tolist()
        together += rank_correlation(*sides, blocks[shuffled].tolist(), rng).p < 0.05
        apart += rank_correlation(*sides, range(64), rng).p < 0.05
    assert together <= 6
    assert apart >= 10


def test_a_block_that_a_stratum_lacks_is_no_hindrance(few_resamples):
    rng, blocks, strata = np.random.default_rng(7), np.tile(np.arange(8), 4), np.repeat(np.arange(4), 8)
    metric = rng.normal(size=32)
    success, kept = metric + 0.3 * rng.normal(size=32), np.ones(32, bool)
    kept[[3, 12, 13]] = False
    whole = rank_correlation(metric, success, strata.tolist(), blocks.tolist(), rng)
    partly = rank_correlation(metric[kept], success[kept], strata[kept].tolist(), blocks[kept].tolist(), rng)
    assert partly.units == 29
    assert partly.blocks == whole.blocks == 8
    assert partly.estimate == pytest.approx(whole.estimate, abs=0.1)
    assert partly.p < 0.05


def test_ranks_turn_with_the_sign_and_know_no_units():
    rng = np.random.default_rng(5)
    x, y, strata = rng.normal(size=12), rng.normal(size=12), [0, 1] * 6
    one = rank_correlation(x, y, strata, range(12), np.random.default_rng(0)).estimate
    assert rank_correlation(-x, y, strata, range(12), np.random.default_rng(0)).estimate == pytest.approx(
        -one
    )
    assert rank_correlation(np.exp(x), 9.0 * y - 3.0, strata, range(12), rng).estimate == pytest.approx(one)


def test_where_nothing_varies_nothing_is_said():
    rng = np.random.default_rng(0)
    assert rank_correlation(np.ones(5), np.arange(5.0), ["a"] * 5, range(5), rng) is None
    assert rank_correlation(np.arange(3.0), np.arange(3.0), ["a", "b", "c"], range(3), rng) is None
    with pytest.raises(HandrailError, match="equal sizes"):
        rank_correlation(np.ones(5), np.ones(4), ["a"] * 5, range(5), rng)
    assert judged(modes=1, draws=1)["mode"].between is None


def test_the_words_claim_no_more(few_resamples):
    some, none = (
        predictions(cells(), np.random.default_rng(1)),
        predictions(cells(2, 2), np.random.default_rng(1)),
    )
    assert "sparc" not in prediction_words(none)
    assert "does not show" in prediction_words(none)
    assert "Between modes none can be" in prediction_words(none)
    assert "none can be" not in prediction_words(some)
    assert "smoothness (SPARC) (between modes, ρ −1.00, the other way than was thought)" in prediction_words(
        some
    )
    assert "cannot be said" in prediction_words([])
    assert len(prediction_table(some).rows) == len(some)

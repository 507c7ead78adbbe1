"""What a comparison claims follows the data: not how many episodes, scenes or comparisons there were."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from compare_helpers import condition, judge

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.collection import collected, success_difference
from handrail.datasets.comparison.episodes import differences
from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.policies import LIKE_FOR_LIKE, MIXED, judge_pairs, pair, pairs_between
from handrail.datasets.format.schema import Feature
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.episode_set import frames_of
from handrail.datasets.quality.measure import measure
from handrail.datasets.reading.demonstration import Demonstration
from handrail.datasets.reading.reader import DatasetInfo
from handrail.datasets.statistics.contrast import adjusted, holm
from handrail.datasets.statistics.paired import wilson
from handrail.datasets.statistics.proportions import (
    independent_trials,
    paired_shares,
    unpaired_shares,
)
from handrail.datasets.statistics.resampling import Run, p_of_means

OF_GROUP = [metric for metric in METRICS if metric.of_dataset]
FEATURES = {
    "observation.state": Feature("float64", (3,), ("x", "y", "goal")),
    "action": Feature("float64", (2,), ("v_x", "v_y")),
}
INFO = DatasetInfo(Path("one"), 20, "arm", FEATURES, 9, 450, "", "", from_handrail=False)


def rng(*seed):
    return np.random.default_rng(seed)


def episode(number, generator, **meta):
    """A minimum-jerk way to a goal that differs, with an operator's noise; 40 to 60 frames."""
    count = int(generator.integers(40, 61))
    time = np.linspace(0.0, 1.0, count)[:, None]
    goal = generator.normal(size=(1, 2))
    state = (10 * time**3 - 15 * time**4 + 6 * time**5) * goal + 0.02 * generator.normal(size=(count, 2))
    frames = {
        "observation.state": np.hstack([state, np.full((count, 1), goal.sum())]),
        "action": np.gradient(state, axis=0),
    }
    return Demonstration(number, INFO, frames, {"length": count, "tasks": ["go"], **meta})


def group(label, count, generator, **meta):
    return Group(label, INFO, tuple(episode(k, generator, **meta) for k in range(count)))


def compared(groups, generator):
    measured = measure({each.label: each.episodes for each in groups}, generator, metrics=METRICS)
    return measured, differences(groups, measured, groups[-1].label, generator)


@pytest.mark.parametrize("counts", [(36, 12), (12, 12)])
def test_more_episodes_of_the_same_are_no_difference(few_resamples, counts):
    for seed in range(3):
        generator = rng(seed, *counts)
        groups = [group(label, count, generator) for label, count in zip("ab", counts, strict=True)]
        _, found = compared(groups, generator)
        assert not any(each.detected for each in found)
        tested = [each for each in found if each.interval]  # what is not costs no power
        assert [each.p_adjusted for each in tested] == pytest.approx(holm([each.p for each in tested]))
        told = [each for each in found if each.measure in OF_GROUP]
        assert [each.measure for each in told] == OF_GROUP
        for each in told:
            assert (each.interval, each.p, each.p_adjusted) == (None, None, None)
            assert bool(each.reason) == (counts[0] != counts[1])


def test_as_many_frames_stand_for_every_group(monkeypatch):
    seen = []
    metric = METRICS[[each.name for each in METRICS].index("state_coverage")]
    generator = rng(4)
    groups = [group("few", 9, generator), group("many", 30, generator)]
    monkeypatch.setattr(
        "handrail.datasets.quality.consistency.entropy",
        lambda points: seen.append(len(points)) or np.zeros(len(points)),
    )
    measure({each.label: each.episodes for each in groups}, generator, metrics=[metric])
    assert seen[0] == seen[1] == sum(each.count for each in groups[0].episodes)


@pytest.mark.parametrize("most", [1, 7, 100, 101, 10_000])
def test_frames_of_episodes(most):
    """Exactly as many as asked for if there are; each at most once; evenly spaced."""
    lengths = [each.count for each in group("a", 5, rng(5)).episodes]
    chosen = frames_of(lengths, most)
    assert sum(map(len, chosen)) == min(most, sum(lengths))
    assert max(map(len, chosen)) - min(map(len, chosen)) <= (1 if most <= 200 else 21)
    for length, frames in zip(lengths, chosen, strict=True):
        assert len(set(frames)) == len(frames)
        assert set(frames) <= set(range(length))
        if len(frames) > 1:
            assert np.ptp(np.diff(frames)) <= 1


@pytest.mark.parametrize("count", [100, 1000, 1500, 3000])
def test_frames_of_many_episodes_are_of_all_their_parts_alike(count):
    """Also where an episode has but one or two: what is measured does not become what they begin with."""
    chosen = np.concatenate(frames_of([80] * count, 2048))
    parts = np.bincount(chosen // 10, minlength=8) / len(chosen)
    np.testing.assert_allclose(parts, 1 / 8, atol=0.01)


def test_the_success_that_is_shown_is_the_one_that_is_tested():
    one = group("a", 12, rng(6), success=True, attempts=3)
    other = group("b", 10, rng(7), success=False)
    assert tuple(collected(each, "")[0].estimate for each in (one, other)) == (1.0, 0.0)
    assert success_difference(one, other).estimate == 1.0


@pytest.mark.parametrize("value", [float("nan"), None, "yes"])
def test_a_success_that_nobody_recorded_is_none(value):
    assert episode(0, rng(), success=value).success is None


def test_pairs_are_all_episodes_or_none():
    generator = rng(8)
    seeded = [tuple(episode(k, generator, seed=k, success=True) for k in range(n)) for n in (10, 9)]
    one, other = (Group(label, None, each) for label, each in zip("ab", seeded, strict=True))  # type: ignore[arg-type]
    assert not success_difference(one, other).paired
    assert success_difference(one.first(9), other).paired
    measured = measure({"a": one.episodes, "b": other.episodes}, generator, metrics=METRICS[:1])
    assert measured.values["length"]["a"].known.size


def condition_of(label, mean, policies, generator, scenes=100, luck=0.0, difficulty=0.0):
    """Policies that differ by `luck` of their training, in scenes that differ in `difficulty`."""
    found = []
    for seed in range(policies):
        share = mean + luck * generator.normal() + difficulty
        values = (generator.random(scenes) < np.clip(share, 0.0, 1.0)).astype(float)
        found.append(Run(0, seed, tuple(range(scenes)), values))
    return condition(label, found)


@pytest.mark.parametrize(("policies", "luck"), [(3, 0.05), (3, 0.1), (5, 0.1)])
def test_detectable_differences_are_detected_four_times_in_five(few_resamples, policies, luck):
    """A difference that experiments claim to see, in 60 others like them: seen in 60 to 95 % of these."""
    generator = rng(9, policies, int(100 * luck))

    def experiment(difference):
        conditions = [
            condition_of(x, 0.5 + 0.5 * s * difference, policies, generator, luck=luck)
            for x, s in (("a", 1), ("b", -1))
        ]
        return judge({each.label: each for each in conditions}, "b", generator).differences[0]

    claimed = float(np.median(np.array([experiment(0.2).seen for _ in range(20)], dtype=float)))
    assert 0.6 <= np.mean([experiment(claimed).detected for _ in range(60)]) <= 0.95


def test_more_comparisons_see_less(few_resamples):
    generator = rng(10)
    conditions = {x: condition_of(x, 0.5, 3, generator, luck=0.1) for x in "abcd"}
    (alone,) = judge_pairs(conditions, [pair("a", "d")], generator).differences
    family = adjusted([alone, *judge(conditions, "d", generator).differences])
    assert family[0].tests == 4
    assert family[0].seen > alone.seen
    assert [each.p_adjusted for each in family] == holm([each.p for each in family])


def test_every_family_is_corrected_for_itself(few_resamples):
    generator = rng(15)
    conditions = {x: condition_of(x, 0.5, 3, generator, luck=0.1) for x in "abcd"}
    pairs = [pair("a", "d"), pair("b", "d", "mixed"), pair("c", "d")]
    like, mixed, also = judge_pairs(conditions, pairs, generator).differences
    assert [each.family for each in (like, mixed, also)] == [LIKE_FOR_LIKE, "mixed", LIKE_FOR_LIKE]
    assert [each.tests for each in (like, mixed, also)] == [2, 1, 2]
    assert [like.p_adjusted, also.p_adjusted] == holm([like.p, also.p])
    assert mixed.p_adjusted == mixed.p


@pytest.mark.parametrize("hard", [0.0, 0.45])
def test_an_interval_over_scenes_covers(few_resamples, hard):
    """Three policies in the same 60 scenes: 95 % of 200 intervals should hold what any scenes give."""
    generator, covered, naive = rng(11), 0, 0
    for _ in range(200):
        difficulty = hard * generator.choice([-1.0, 1.0], size=60)
        found = condition_of("a", 0.5, 3, generator, scenes=60, difficulty=difficulty)
        outcome = judge({"a": found}, "a", generator).successes["a"]
        covered += outcome.interval[0] <= 0.5 <= outcome.interval[1]
        low, high = wilson(found.successes, len(found.rollouts))
        naive += low <= 0.5 <= high
    assert covered >= 182
    assert hard == 0.0 or naive < 170


@pytest.mark.parametrize("paired", [True, False])
def test_the_same_rollouts_three_times_say_no_more(paired):
    one, other = (rng(14, k).random(100) < share for k, share in enumerate((0.7, 0.4)))
    twice = list(np.tile(one, 3)), list(np.tile(other, 3))
    scenes = [*range(100)] * 3
    if paired:
        once, again = paired_shares(one, other), paired_shares(*twice, scenes)
    else:
        once, again = unpaired_shares(one, other), unpaired_shares(*twice, (scenes, scenes))
    assert again.estimate == pytest.approx(once.estimate)
    assert again.interval == pytest.approx(once.interval, abs=2e-3)
    assert again.errors[0][0] == pytest.approx(once.errors[0][0], rel=0.03)
    assert again.p == pytest.approx(once.p, rel=1e-6 if paired else 0.1)


def test_how_many_trials_scenes_are_worth():
    values = rng(12).integers(0, 2, size=300).astype(float)
    assert independent_trials(values, range(300)) == pytest.approx(300)
    assert independent_trials(np.tile(values, 3), [*range(300)] * 3) == pytest.approx(300, rel=0.01)
    assert independent_trials(np.ones(30), [*range(10)] * 3) == 10.0
    alike = independent_trials(rng(13).integers(0, 2, size=900).astype(float), [*range(300)] * 3)
    assert 750 < alike <= 900


def test_a_condition_is_compared_with_the_baseline_of_its_own_kind():
    labels = ["ee", "direct"]
    conditions = ["ee", "ee intent", "direct", "ee intent same number", "direct same number", "ee filter"]
    assert pairs_between(conditions, "direct", labels) == [
        pair("ee", "direct"),
        pair("ee intent", "direct", MIXED),
        pair("ee intent same number", "direct same number", MIXED),
        pair("ee filter", "direct", MIXED),
    ]
    assert pairs_between(["ee"], "direct", labels) == []
    with pytest.raises(
        HandrailError, match="expected a condition 'direct' to compare 'ee' with, got ee, direct same"
    ):
        pairs_between(["ee", "direct same number"], "direct", labels)


@pytest.mark.parametrize("metric", OF_GROUP, ids=lambda metric: metric.name)
def test_a_measure_of_a_dataset_is_its_mean_over_the_frames(metric):
    generator = rng(5)
    lengths = (400, *[10] * 9)
    episodes = []
    for number, length in enumerate(lengths):
        states = generator.normal(size=(length, 3)) * (1.0 if length > 10 else 0.05)
        frames = {"observation.state": states, "action": states[:, :2]}
        episodes.append(Demonstration(number, INFO, frames, {"length": length, "tasks": ["go"]}))
    measured = measure({"all": episodes}, rng(0), metrics=[metric])
    of_frames = metric.measure(measured.groups["all"], rng(0))
    assert measured.values[metric.name]["all"].estimate == pytest.approx(np.nanmean(of_frames))


def test_a_difference_is_detected_among_many_tests(few_resamples):
    (length,) = [metric for metric in METRICS if metric.name == "length"]
    many = [replace(length, name=f"length_{number}") for number in range(101)]
    short = group("short", 12, rng(6))
    slow = [replace(each, meta={**each.meta, "length": 3 * each.count}) for each in short.episodes]
    groups = [Group("slow", INFO, tuple(slow)), short]
    measured = measure({each.label: each.episodes for each in groups}, rng(0), metrics=many)
    found = differences(groups, measured, "short", rng(0))
    assert [each.tests for each in found] == [101] * 101
    assert all(each.detected for each in found)


@pytest.mark.parametrize(("few", "many"), [(20, 100), (10, 50)])
def test_a_smaller_group_that_varies_more_is_no_difference(few_resamples, few, many):
    """Equal means; permuted differences of means call 29 % of these a difference, permuted t 11 % at 10."""
    generator = rng(8)
    called = 0
    for _ in range(400):
        samples = generator.normal(scale=3.0, size=few), generator.normal(size=many)
        called += p_of_means(samples, False, generator) < 0.05
    assert called <= 32

"""What learnability has to be, whatever the data: laws, with data of which the truth is known."""

from dataclasses import replace

import numpy as np
import pytest

from handrail.datasets.demonstrations.demonstration import DoesNotApply
from handrail.datasets.learnability.learnability import learnability
from handrail.datasets.learnability.policy_rows import recorded_view
from handrail.datasets.learnability.sample import Budget, take


def linear(state, seen, hidden, rng):
    weights = np.arange(20.0).reshape(4, 5) - 9.5
    return seen @ weights


def noise(state, seen, hidden, rng):
    return rng.normal(size=(len(seen), 5))


def judged(group, seed=0, **options):
    found = learnability(group, np.random.default_rng(seed), **options)
    return found.spaces["action"]


def plain(found):
    return {part: (score.estimate, *score.interval) for part, score in found.parts.items()}


def test_a_linear_function_of_what_is_seen_is_told_wholly(episodes):
    found = judged(episodes(linear))
    assert set(found.parts) == {"all", "base xy", "base turn", "arm", "gripper"}
    for score in found.parts.values():
        assert score.estimate == pytest.approx(1.0, abs=1e-3)
    assert all(abs(score.estimate) < 1e-3 for by_part in found.gains.values() for score in by_part.values())


def test_a_smooth_function_is_told_too(episodes):
    def smooth(state, seen, hidden, rng):
        return np.column_stack([np.sin(seen[:, 0] + k) * np.tanh(seen[:, 1]) for k in range(5)])

    assert judged(episodes(smooth)).parts["all"].estimate > 0.8


def test_nothing_is_told_of_noise(episodes):
    score = judged(episodes(noise, count=30)).parts["all"]
    assert -0.1 < score.estimate < 0.05
    assert score.interval[0] < score.estimate < score.interval[1]


def test_what_decides_is_named_whether_it_is_hidden_or_seen(episodes):
    """Where the base stands moves the base, not what turns it."""

    def plan(state, seen, hidden, rng):
        return np.column_stack([state[:, :2], seen[:, :2], rng.integers(0, 2, len(seen))])

    def blind(episode):
        rows = recorded_view(episode)
        return replace(rows, seen=rows.seen[:, 3:], shown={})

    group = episodes(plan, count=30)
    hidden, seen = judged(group, view=blind), judged(group)
    assert hidden.parts["base xy"].estimate < 0.1 < 0.9 < seen.parts["base xy"].estimate
    for found in (hidden, seen):
        gain = found.gains["base pose"]
        assert gain["base xy"].estimate > 0.8
        assert gain["base xy"].interval[0] > 0.7
        assert abs(gain["base turn"].estimate) < 0.05
        assert abs(found.gains["time"]["base xy"].estimate) < 0.1


def test_units_do_not_matter(episodes):
    scale = np.array([1000.0, 1000.0, 0.01, 57.3, 3.0])
    one, other = (judged(episodes(linear_and_noise, units=units)) for units in (1.0, scale))
    for part, values in plain(one).items():
        assert plain(other)[part] == pytest.approx(values, abs=1e-6)


def linear_and_noise(state, seen, hidden, rng):
    return linear(state, seen, hidden, rng) + 5.0 * rng.normal(size=(len(seen), 5))


def test_the_order_of_the_episodes_does_not_matter(episodes):
    group = episodes(linear_and_noise)
    assert plain(judged(group)) == plain(judged(group[::-1]))


def test_the_same_seed_gives_the_same_numbers_and_another_does_not(episodes):
    group = episodes(linear_and_noise)
    assert plain(judged(group)) == plain(judged(group)) != plain(judged(group, seed=1))


def test_an_unseen_coin_makes_two_heaps_and_noise_does_not(episodes):
    def coin(state, seen, hidden, rng):
        return np.tile(hidden, (len(seen), 5)) + 0.1 * rng.normal(size=(len(seen), 5))

    def habits(state, seen, hidden, rng):  # of each episode, but of all together no two heaps
        return np.tile(rng.normal(size=5), (len(seen), 1)) + 0.1 * rng.normal(size=(len(seen), 5))

    assert judged(episodes(coin, count=60)).two_heaps.estimate > 0.7
    assert judged(episodes(noise, count=60)).two_heaps.estimate < 0.2
    assert judged(episodes(habits, count=60)).two_heaps.estimate < 0.4
    assert judged(episodes(coin, count=16)).two_heaps is None


def test_each_phase_is_judged_by_itself(episodes):
    def worse_later(state, seen, hidden, rng):
        late = np.arange(len(seen)) >= len(seen) / 2
        return np.where(late[:, None], noise(state, seen, hidden, rng), linear(state, seen, hidden, rng))

    phases = judged(
        episodes(worse_later, count=30, phase=lambda share: "late" if share >= 0.5 else "early")
    ).phases
    assert set(phases) == {"early", "late"}
    assert phases["early"].estimate > 0.6 > 0.0 > phases["late"].estimate  # what fits both fits neither
    assert set(judged(episodes(linear)).phases) == {"first third", "second third", "last third"}


def test_no_more_is_read_than_the_budget_allows(episodes):
    group, read = episodes(linear, count=30), []

    def counting(episode):
        read.append(episode.number)
        return recorded_view(episode)

    sample = take(group, counting, Budget(10, 100), np.random.default_rng(0))
    assert len(read) == len(set(read)) == sample.episodes == 10
    assert len(sample.seen) <= 100


def test_too_little_says_why(episodes):
    with pytest.raises(DoesNotApply, match="fewer than 6 episodes"):
        judged(episodes(linear, count=5))
    with pytest.raises(DoesNotApply, match="ever changes"):
        judged(episodes(lambda state, *_: np.zeros((len(state), 5))))

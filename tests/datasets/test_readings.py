"""Measuring what lies on the disk: as what is in memory, but with one episode in memory at a time."""

import weakref

import numpy as np
import pytest
from canned import canned
from compare_helpers import handrail_dataset
from hypothesis import given
from hypothesis import strategies as st

from handrail.datasets.quality.measure import measure, measure_views
from handrail.datasets.quality.metric import metric
from handrail.datasets.quality.scale import Extent, Spread, embed
from handrail.datasets.reading import load
from handrail.datasets.reading.demonstration import Demonstration
from handrail.datasets.reading.load import read_demonstrations, recorded_episodes


@pytest.fixture(scope="module")
def root():
    return canned(handrail_dataset, 3, "ee", 20)


def test_metrics_from_the_disk_are_those_from_memory(root):
    """In every view, also where an episode is in several, which is measured once for all."""
    on_disk, here = recorded_episodes(root), read_demonstrations(root)
    views = [{"a": slice(0, 12), "b": slice(6, 20)}, {"a": slice(0, 5), "b": slice(6, 9)}]
    chosen = [{label: on_disk[part] for label, part in view.items()} for view in views]
    generator = np.random.default_rng(0)
    for view, found in zip(
        views, measure_views(dict(zip("xy", chosen, strict=True)), generator), strict=True
    ):
        generator.bit_generator.state = np.random.default_rng(0).bit_generator.state
        expected = measure({label: here[part] for label, part in view.items()}, np.random.default_rng(0))
        for name, groups in found.values.items():
            for label, each in groups.items():
                other = expected.values[name][label]
                np.testing.assert_array_equal(each.values, other.values, err_msg=name)
                assert (each.interval, each.reason) == (other.interval, other.reason)


@pytest.mark.parametrize(("end", "begin"), [(10, 10), (12, 6)])
def test_one_episode_is_in_memory_at_a_time(end, begin, root, monkeypatch):
    """Beside the first of each group, and the frames that stand for it; one of two groups is read once."""
    alive, most = [], []

    def opened(*parts):
        episode = Demonstration(*parts)
        alive.append(weakref.ref(episode.frames["action"]))
        most.append(sum(each() is not None for each in alive))
        return episode

    monkeypatch.setattr(load, "Demonstration", opened)
    episodes = recorded_episodes(root)
    measure({"a": episodes[:end], "b": episodes[begin:]}, np.random.default_rng(0))
    assert 2 * len(episodes) <= len(most) <= 2 * len(episodes) + 2
    assert max(most) <= 4


def test_a_metric_of_one_s_own_is_measured_like_ours(root):
    @metric("frames", "lower")
    def half_the_frames(episode, scale):
        """Half the number of frames."""
        return 0.5 * episode.count

    @metric("frames", of_dataset=True)
    def frames_of_all(dataset, rng):
        return np.full(len(dataset.owner), len(dataset.owner))

    assert (half_the_frames.title, half_the_frames.meaning) == (
        "half the frames",
        "half the number of frames",
    )
    episodes = recorded_episodes(root)
    found = measure(
        {"a": episodes}, np.random.default_rng(0), metrics=[half_the_frames, frames_of_all]
    ).values
    counts = [each.count for each in episodes]
    assert found["half_the_frames"]["a"].values.tolist() == [0.5 * count for count in counts]
    assert found["frames_of_all"]["a"].estimate == sum(counts)


@given(
    cuts=st.lists(st.integers(1, 59), max_size=6, unique=True),
    offset=st.sampled_from([0.0, 1e6]),
    seed=st.integers(0, 99),
)
def test_a_scale_does_not_hang_on_how_the_rows_come(cuts, offset, seed):
    """Mean, scatter, range and the map onto few numbers are those of all rows at once."""
    generator = np.random.default_rng(seed)
    rows = np.column_stack(
        [generator.normal(size=(60, 3)) + offset, generator.integers(0, 2, 60), np.ones(60)]
    )
    spread, extent = Spread(), Extent()
    for part in np.split(rows, sorted(cuts)):
        spread.add(part)
        extent.add(part)
    away = rows - rows.mean(axis=0)
    assert spread.count == 60
    np.testing.assert_allclose(spread.mean, rows.mean(axis=0))
    np.testing.assert_allclose(spread.scatter, away.T @ away, atol=1e-6)
    low, high = extent.range
    np.testing.assert_array_equal(low, rows.min(axis=0))
    np.testing.assert_array_equal(high[:3], rows.max(axis=0)[:3])
    np.testing.assert_array_equal(high[3:], low[3:])  # a switch and a constant have no range
    whole = Spread()
    whole.add(rows)
    for most in (None, 2):
        one, other = embed(spread, most)(rows), embed(whole, most)(rows)
        np.testing.assert_allclose(np.abs(one), np.abs(other), atol=1e-4)
    assert embed(spread)(rows).shape == (60, 4)
    np.testing.assert_allclose(embed(spread)(rows).std(axis=0), 1.0, rtol=1e-6)

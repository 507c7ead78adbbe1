"""Statistics agree with LeRobot's on anything, not only on what we happen to record."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handrail.datasets.format.stats import (
    STATISTICS,
    column_stats,
    image_levels,
    image_stats,
    merge_stats,
    sample_indices,
)

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from lerobot.datasets import compute_stats as lerobot


def _same(found, expected, bins=0):
    """Check all statistics; quantiles may be off by some of the 5,000 bins if a value lies on an edge."""
    span = expected["max"].astype(float) - expected["min"]
    for name in STATISTICS:
        assert found[name].shape == expected[name].shape, name
        slack = 1e-7 + (bins * span / 5000 if name.startswith("q") else 0)
        assert np.all(np.abs(found[name] - expected[name]) <= slack + 1e-5 * np.abs(expected[name])), name


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 300),
    st.integers(1, 5),
    st.sampled_from(["float32", "float64", "int64", "bool", "uint8"]),
    st.sampled_from(["spread", "steps", "still"]),
)
def test_columns(seed, rows, width, dtype, kind):
    generator = np.random.default_rng(seed)
    values = {
        "spread": lambda: generator.normal(3, 20, (rows, width)),
        "steps": lambda: generator.integers(0, 4, (rows, width)).astype(float),
        "still": lambda: np.full((rows, width), 0.7),
    }[kind]()
    values = values.clip(0, 200).astype(dtype) if dtype == "uint8" else values.astype(dtype)
    _same(column_stats(values), lerobot.get_feature_stats(values, axis=0, keepdims=False))
    if width == 1:
        flat = values[:, 0]
        _same(column_stats(flat), lerobot.get_feature_stats(flat, axis=0, keepdims=True))


@pytest.mark.parametrize(
    ("count", "shape"), [(1, (320, 480)), (7, (32, 48)), (7, (400, 310)), (120, (32, 48))]
)
def test_pictures(count, shape):
    generator = np.random.default_rng(count)
    pictures = generator.integers(0, 200, (count, *shape, 3), dtype=np.uint8)
    chosen = [pictures[i].transpose(2, 0, 1) for i in lerobot.sample_indices(count)]
    seen = np.stack([lerobot.auto_downsample_height_width(picture) for picture in chosen])
    # in float64: LeRobot sums pictures in float32 and so misses their spread by 0.1 %
    expected = lerobot.get_feature_stats(seen.astype(float), axis=(0, 2, 3), keepdims=True)
    expected = {k: v if k == "count" else np.squeeze(v / 255, axis=0) for k, v in expected.items()}
    _same(image_stats([image_levels(picture) for picture in pictures]), expected, bins=1)


@pytest.mark.parametrize("length", [1, 2, 99, 100, 101, 463, 465, 2000, 300_000])
def test_the_same_frames_are_looked_at(length):
    assert sample_indices(length) == lerobot.sample_indices(length)


@pytest.mark.parametrize(("dtype", "large"), [("float32", 3e38), ("float64", 1.7e308), ("float64", 1e160)])
def test_numbers_of_any_size_have_finite_statistics(dtype, large):
    """Squares of large numbers are infinite, and NaN or Infinity in `stats.json` is no JSON."""
    rows = np.array([[1.0, large], [2.0, -large], [3.0, large], [4.0, large]], dtype)
    stats = column_stats(rows)
    twice = merge_stats({"a": stats}, {"a": stats})["a"]
    for each in (stats, twice):
        assert all(np.isfinite(value).all() for value in each.values())
        assert np.allclose(each["mean"], [2.5, large / 2], rtol=1e-6)
        assert np.allclose(each["std"], [np.std(rows[:, 0]), large * np.sqrt(0.75)], rtol=1e-6)


def test_values_that_are_not_finite_are_left_out():
    values = np.array([[1.0, np.nan, np.inf], [3.0, np.nan, 5.0], [2.0, np.nan, 7.0]])
    stats = column_stats(values)
    assert stats["mean"].tolist() == [2.0, 0.0, 6.0]
    assert stats["max"].tolist() == [3.0, 0.0, 7.0]
    assert stats["count"].tolist() == [3]
    assert all(np.isfinite(stats[name]).all() for name in STATISTICS)

"""Statistics of an episode and of a dataset, the same numbers as `lerobot.datasets.compute_stats` gives.

Per column: min, max, mean, std, count and the quantiles 1, 10, 50, 90, 99 %, interpolated in a histogram.
Pictures: per channel over at most a few hundred frames, in [0, 1], from a 256-level histogram a frame.

LeRobot's quantiles of a dataset are means of the episodes' quantiles weighted by their counts; so are these.
"""

from collections.abc import Mapping

import numpy as np

Statistics = dict[str, np.ndarray]
"""Of one column, by name."""
Stats = dict[str, Statistics]
"""By column."""

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
_SHARES = np.array(list(QUANTILES.values()))
BINS = 5000
STATISTICS = ("min", "max", "mean", "std", "count", *QUANTILES)
MEASURED = tuple(name for name in STATISTICS if name != "count")
_LARGE = 1e150  # what may be squared
_LEVELS = np.arange(256, dtype=np.float64)


def column_stats(values: np.ndarray) -> Statistics:
    """Return the statistics of one numeric column of an episode.

    Args:
        values: One row a frame, `(N,)` or `(N, d)`, N ≥ 1. Values that are not finite are left out; an
            entry without any finite value counts as 0, so that the files stay valid JSON.

    Returns:
        Ten arrays of shape `(d,)` float64, `count` `(1,)` int64.
    """
    rows = values.reshape(len(values), -1)
    if rows.dtype.kind == "f" and not np.isfinite(rows).all():
        return _finite_stats(rows)
    if len(rows) < 2:
        stats = {name: rows[0].astype(np.float64) for name in STATISTICS}
        stats |= {"std": np.zeros(rows.shape[1]), "count": np.array([len(rows)])}
        return stats
    rows = rows.astype(np.result_type(rows.dtype, np.float32), copy=False)
    too_large = rows.dtype.kind == "f" and np.abs(rows).max() > np.finfo(rows.dtype).max ** 0.4
    return _many_rows_stats(rows.astype(np.longdouble) if too_large else rows)  # what is squared is finite


def image_levels(image: np.ndarray) -> np.ndarray:
    """Return how often each level occurs in each channel of a picture.

    Args:
        image: `(height, width, 3)` uint8; from 300 pixels on, LeRobot looks at every k-th pixel only.

    Returns:
        Counts, `(3, 256)` int32.
    """
    image = image[:: _stride(image), :: _stride(image)]
    return np.stack([np.bincount(image[..., c].ravel(), minlength=256) for c in range(3)]).astype(np.int32)


def image_stats(levels: list[np.ndarray]) -> Statistics:
    """Return the statistics of one camera over an episode.

    Args:
        levels: For each frame, what `image_levels` gave.

    Returns:
        Ten arrays of shape `(3, 1, 1)` in [0, 1], `count` the number of frames looked at.
    """
    chosen = sample_indices(len(levels))
    counts = np.stack([levels[index] for index in chosen]).sum(axis=0, dtype=np.int64)  # (3, 256)
    channels = [_level_stats(counts[c]) for c in range(3)]
    stats = {
        name: np.array([channel[name] for channel in channels]).reshape(3, 1, 1) / 255.0
        for name in channels[0]
    }
    return stats | {"count": np.array([len(chosen)])}


def sample_indices(length: int) -> list[int]:
    """Return which frames of an episode the picture statistics look at: all of 100, 100 of 400."""
    wanted = max(min(100, length), min(int(length**0.75), 10_000))
    return np.round(np.linspace(0, length - 1, wanted)).astype(int).tolist()


def merge_stats(first: Stats | None, second: Stats) -> Stats:
    """Return the statistics of two sets of frames taken together, as LeRobot aggregates them.

    Raises:
        ValueError: They are not of the same columns.
    """
    if first is None:
        return second
    if first.keys() != second.keys():
        raise ValueError(f"statistics of other columns: {', '.join(sorted(first.keys() ^ second.keys()))}")
    return {key: _merge_column(first[key], second[key]) for key in second}


def stats_to_lists(stats: Stats) -> dict[str, dict[str, list]]:
    """Return statistics as plain lists, for JSON and parquet."""
    return {key: {name: column[name].tolist() for name in STATISTICS} for key, column in stats.items()}


def stats_from_lists(lists: Mapping[str, Mapping[str, list]]) -> Stats:
    """Return statistics as arrays again: the inverse of `stats_to_lists`."""
    return {key: {name: np.array(column[name]) for name in STATISTICS} for key, column in lists.items()}


def _many_rows_stats(rows: np.ndarray) -> Statistics:
    low, high, mean = rows.min(axis=0), rows.max(axis=0), rows.mean(axis=0)
    variance = np.mean(rows**2, axis=0) - mean**2
    stats = {"min": low, "max": high, "mean": mean, "std": np.sqrt(np.maximum(0, variance))}
    edges = np.linspace(low - 1e-10, high + 1e-10, BINS + 1)  # (BINS + 1, d)
    stats |= dict(zip(QUANTILES, _quantiles(rows, edges), strict=True))
    return {name: value.astype(np.float64) for name, value in stats.items()} | {
        "count": np.array([len(rows)])
    }


def _quantiles(values: np.ndarray, edges: np.ndarray, counts: np.ndarray | None = None) -> np.ndarray:
    """Return quantiles of columns, (5, d), interpolated inside the first bin up to which enough values lie.

    In the first bin it is the lower edge, as LeRobot has it.

    Args:
        values: `(N, d)`; rising where they are counted.
        edges: of the bins, `(BINS + 1, d)`; the last bin is closed.
        counts: How often each row occurs, `(N,)`; once without.
    """
    pairs = zip(edges.T, values.T, strict=True)
    above = np.stack([np.searchsorted(*each, side="right") for each in pairs], axis=1)
    bins = np.sort(np.minimum(above, BINS) - 1, axis=0)
    counts = np.ones(len(bins), dtype=int) if counts is None else counts
    ranks = np.cumsum(counts)
    targets = _SHARES * ranks[-1]
    chosen = bins[np.searchsorted(ranks, targets)]
    before, upto = counts @ (bins < chosen[:, None]), counts @ (bins <= chosen[:, None])
    share = (targets[:, None] - before) / (upto - before)
    lower, upper = (np.take_along_axis(edges, chosen + more, axis=0) for more in (0, 1))
    return lower + share * np.where(chosen > 0, upper - lower, 0.0)


def _level_stats(counts: np.ndarray) -> dict[str, float | np.floating]:
    """Return the statistics of pixels of which `counts[v]` have the value v, `(256,)`."""
    total, present = counts.sum(), np.flatnonzero(counts)
    mean = counts @ _LEVELS / total
    low, high = np.float32(present[0]), np.float32(present[-1])
    edges = np.linspace(low - 1e-10, high + 1e-10, BINS + 1)[:, None]
    found = _quantiles(_LEVELS[present, None], edges, counts[present])[:, 0]
    quantiles = dict(zip(QUANTILES, found, strict=True))
    spread = np.sqrt(max(0.0, counts @ _LEVELS**2 / total - mean**2))
    return {"min": float(low), "max": float(high), "mean": mean, "std": spread, **quantiles}


def _finite_stats(rows: np.ndarray) -> Statistics:
    columns = [column[np.isfinite(column)] for column in rows.T]
    each = [column_stats(column if column.size else np.zeros(1)) for column in columns]
    stats = {name: np.concatenate([one[name] for one in each]) for name in STATISTICS}
    return stats | {"count": np.array([len(rows)])}


def _merge_column(first: Statistics, second: Statistics) -> Statistics:
    """Return the statistics of a column over two sets of frames."""
    n, m = first["count"], second["count"]
    if max(np.abs(part[name]).max() for part in (first, second) for name in ("min", "max")) > _LARGE:
        first, second = _wide(first), _wide(second)
    mean = (first["mean"] * n + second["mean"] * m) / (n + m)
    parts = ((first, n), (second, m))
    variance = sum((part["std"] ** 2 + (part["mean"] - mean) ** 2) * k for part, k in parts) / (n + m)
    merged = {"mean": mean, "std": np.sqrt(variance)}
    merged |= {name: (first[name] * n + second[name] * m) / (n + m) for name in QUANTILES}
    return {
        "min": np.minimum(first["min"], second["min"]),
        "max": np.maximum(first["max"], second["max"]),
        "count": n + m,
        **{name: value.astype(np.float64) for name, value in merged.items()},
    }


def _wide(column: Statistics) -> Statistics:
    return column | {name: column[name].astype(np.longdouble) for name in ("mean", "std", *QUANTILES)}


def _stride(image: np.ndarray) -> int:
    height, width = image.shape[:2]
    return 1 if max(height, width) < 300 else max(1, int(max(height, width) / 150))

"""Frames of many episodes as one cloud of points, and the nearest of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.quality.demonstration import Demonstration

_CHUNK = 256  # rows of the distance matrix at a time


@dataclass(frozen=True)
class Cloud:
    """Some frames of every episode, about as many of each, so that long episodes do not weigh more.

    Attributes:
        points: `(N, d)`.
        owner: Place of the episode that a point is from, `(N,)`.
    """

    points: FloatArray
    owner: IntArray


def frames_of(episodes: Sequence[Demonstration], most: int) -> list[IntArray]:
    """Return which frames stand for each episode: evenly spaced, as many of all that are long enough.

    Args:
        episodes: Of one group.
        most: Frames of all episodes together; all of them where there are fewer.
    """
    lengths = np.array([episode.count for episode in episodes])
    return [
        np.linspace(0, episode.count - 1, share).round().astype(int)
        for episode, share in zip(episodes, _shares(lengths, most), strict=True)
    ]


def _shares(lengths: IntArray, most: int) -> IntArray:
    """Return how many frames of each episode there are to be: the shorter ones whole, the rest alike, ±1."""
    shares, left = np.zeros_like(lengths), min(most, int(lengths.sum()))
    order = np.argsort(lengths, kind="stable")
    for done, place in enumerate(order):
        shares[place] = min(int(lengths[place]), left // (len(order) - done))
        left -= int(shares[place])
    return shares


def cloud(
    episodes: Sequence[Demonstration],
    frames: Sequence[IntArray],
    read: Callable[[Demonstration], FloatArray],
) -> Cloud:
    """Return the chosen frames as points.

    Args:
        episodes: Of one group.
        frames: Which frames of each, see `frames_of`.
        read: What of an episode, `(N, d)`.
    """
    rows = [read(episode)[chosen] for episode, chosen in zip(episodes, frames, strict=True)]
    owner = np.repeat(np.arange(len(rows)), [len(row) for row in rows])
    return Cloud(np.vstack(rows), owner)


def nearest(points: FloatArray, k: int, group: IntArray | None = None) -> tuple[IntArray, FloatArray]:
    """Return the k nearest other points of every point, and how far they are (Euclidean).

    Args:
        points: `(N, d)`.
        k: How many.
        group: A label of every point, `(N,)`: points with the same label are passed over. None passes over
            only the point itself.

    Returns:
        Places and distances, nearest first, `(N, k)` each; ∞ where there are fewer than k.
    """
    labels = np.arange(len(points)) if group is None else group
    places, distances = [], []
    squares = (points**2).sum(axis=1)
    for start in range(0, len(points), _CHUNK):
        rows = slice(start, start + _CHUNK)
        distance = squares[rows, None] + squares - 2.0 * points[rows] @ points.T
        distance[labels[rows, None] == labels] = np.inf
        place = np.argpartition(distance, k - 1, axis=1)[:, :k]
        found = np.take_along_axis(distance, place, axis=1)
        order = np.argsort(found, axis=1)
        places.append(np.take_along_axis(place, order, axis=1))
        distances.append(np.sqrt(np.maximum(np.take_along_axis(found, order, axis=1), 0.0)))
    return np.vstack(places), np.vstack(distances)


def mean_of_each(values: FloatArray, owner: IntArray, episodes: int) -> FloatArray:
    """Return the mean of the points' values for each episode, `(E,)`; NaN where it has none."""
    known = np.isfinite(values)
    counts = np.bincount(owner[known], minlength=episodes)
    sums = np.bincount(owner[known], weights=values[known], minlength=episodes)
    return np.divide(sums, counts, out=np.full(episodes, np.nan), where=counts > 0)

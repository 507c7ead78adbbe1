"""Whether actions near like observations fall into two heaps: left or right, and nothing seen says which."""

from functools import cache

import numpy as np
from scipy.spatial.distance import cdist

from handrail.controllers.arrays import FloatArray, IntArray

NEIGHBOURS = 16
_SMALLEST = 4  # of a heap
_NORMAL = 4000  # samples of a normal distribution
_CHANCE = 0.05


def two_heaps(seen: FloatArray, left: FloatArray, owner: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return by how much actions vary near each frame, and that where they fall into two heaps, `(N,)` each.

    Of 16 other episodes, those that come nearest, take what a regression leaves of the action in the frame
    that is nearest, along the direction in which it varies most. The best cut into two heaps of four or more
    explains a share of its variance. There are two heaps where that is more than for 95 % of samples of a
    normal distribution, so that the ratio of the sums is 0.05 by chance, and 1 where an unseen coin decides.

    Args:
        seen: `(N, s)`, on one scale, few dimensions.
        left: Action minus what a regression says of it, `(N, a)`, on one scale.
        owner: Which episode a frame is from, rising, of more than 16, `(N,)`.
    """
    begins = np.flatnonzero(np.diff(owner, prepend=-1))
    pieces = [np.arange(*each) for each in zip(begins, [*begins[1:], len(owner)], strict=True)]
    along = np.vstack([_along(left[_nearest(seen, pieces, own)]) for own in range(len(pieces))])
    variance, share = _cut(along)
    return variance, np.where(share > _bound(), variance, 0.0)


def _nearest(seen: FloatArray, pieces: list[IntArray], own: int) -> IntArray:
    """Return for each frame of an episode the nearest frame of the 16 other episodes nearest, `(n, 16)`."""
    distance = cdist(seen[pieces[own]], seen)
    best = np.stack([piece[distance[:, piece].argmin(axis=1)] for piece in pieces], axis=1)
    away = np.take_along_axis(distance, best, axis=1)
    away[:, own] = np.inf
    return np.take_along_axis(best, np.argpartition(away, NEIGHBOURS - 1)[:, :NEIGHBOURS], axis=1)


def _along(points: FloatArray) -> FloatArray:
    """Return points along the direction in which they vary most, `(N, k, a)` → `(N, k)`."""
    away = points - points.mean(axis=1, keepdims=True)
    _, vectors = np.linalg.eigh(away.transpose(0, 2, 1) @ away)
    return (away @ vectors[:, :, -1:])[:, :, 0]


def _cut(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the variance of each row, and the share of it between its two heaps, `(N,)` each."""
    ordered = np.sort(values, axis=1)
    ordered = ordered - ordered.mean(axis=1, keepdims=True)
    count, variance = ordered.shape[1], ordered.var(axis=1)
    sizes = np.arange(_SMALLEST, count - _SMALLEST + 1)
    sums = np.cumsum(ordered, axis=1)[:, sizes - 1]
    between = (sums**2 / (sizes * (count - sizes))).max(axis=1)
    return variance, np.divide(between, variance, out=np.zeros_like(variance), where=variance > 0)


@cache
def _bound() -> float:
    """Return the share that 95 % of samples of a normal distribution stay below."""
    samples = np.random.default_rng(0).normal(size=(_NORMAL, NEIGHBOURS))
    return float(np.quantile(_cut(samples)[1], 1.0 - _CHANCE))

"""How much the actions of a dataset say about its states: mutual information by nearest neighbours."""

from collections.abc import Sequence

import numpy as np
from scipy.special import digamma

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.missing import DoesNotApply

KS = (5, 6, 7)
BATCH = 1024


def information(
    states: FloatArray, actions: FloatArray, rng: np.random.Generator, ks: Sequence[int] = KS
) -> FloatArray:
    """Return each frame's part of the mutual information I(s; a), clipped to its 1st to 99th percentile.

    Î = ψ(k) + ψ(N) − ⟨ψ(n_s + 1) + ψ(n_a + 1)⟩, the first estimator of Kraskov, Stögbauer & Grassberger
    2004, in random batches of about 1024 frames and averaged over k = 5, 6, 7. Its mean over an episode is
    the score of Hejna et al. 2025, "Robot data curation with mutual information estimators" (DemInf). For
    two normal numbers of correlation ρ it is −½ log(1 − ρ²); for independent ones 0.

    Args:
        states: `(N, s)`, on one scale; few dimensions, since the estimate falls short in many.
        actions: `(N, a)`, on one scale; relative ones work best.
        rng: Of the batches.
        ks: Which neighbours.

    Returns:
        `(N,)` [nat].

    Raises:
        DoesNotApply: There are too few frames.
    """
    if len(states) <= max(ks) + 1:
        raise DoesNotApply(f"there are only {len(states)} frames")
    order = rng.permutation(len(states))
    parts = np.empty(len(states))
    for batch in np.array_split(order, max(1, round(len(order) / BATCH))):
        parts[batch] = _batch(states[batch], actions[batch], ks)
    return np.clip(parts, *np.percentile(parts, [1, 99]))


def _batch(states: FloatArray, actions: FloatArray, ks: Sequence[int]) -> FloatArray:
    apart, acted = chebyshev(states), chebyshev(actions)
    both = np.maximum(apart, acted)
    count = len(states)
    radii = np.partition(both, [k - 1 for k in ks], axis=1)[:, [k - 1 for k in ks]]
    parts = [
        digamma(k) + digamma(count) - digamma(_within(apart, radius)) - digamma(_within(acted, radius))
        for k, radius in zip(ks, radii.T, strict=True)
    ]
    return np.mean(parts, axis=0)


def _within(distances: FloatArray, radius: FloatArray) -> FloatArray:
    """Return 1 + how many others are strictly nearer than the radius, `(N,)`."""
    return 1.0 + np.count_nonzero(distances < radius[:, None], axis=1)


def chebyshev(points: FloatArray) -> FloatArray:
    """Return the largest difference in any entry between any two points, `(N, N)`; ∞ to itself."""
    largest = np.zeros((len(points), len(points)))
    for column in points.T:
        np.maximum(largest, np.abs(column[:, None] - column), out=largest)
    np.fill_diagonal(largest, np.inf)
    return largest

"""Kernel ridge regression on some of the points (Nyström), judged on what it was not fitted to."""

from collections.abc import Iterator

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular
from scipy.spatial.distance import cdist, pdist

from handrail.controllers.arrays import FloatArray, IntArray

_LENGTHS = (0.5, 1.5)  # of the median distance between landmarks
_RIDGES = (1e-5, 1e-3, 1e-2)  # a frame
_JITTER = 1e-8


def held_out(inputs: FloatArray, targets: FloatArray, fold: IntArray, landmarks: IntArray) -> FloatArray:
    """Return what a regression says of each point that was fitted to the other folds, `(N, a)`.

    ŷ = f(x), f of least Σ (y − f(x))² + λ N ‖f‖² with the kernel exp(−‖x − x'‖² / 2 ℓ²) + xᵀx' / s on some
    landmarks (Nyström; Williams and Seeger 2001). ℓ and λ are chosen for each target on the fold after
    the one that is held out, then all but the held-out one are fitted.

    Args:
        inputs: `(N, s)`, on one scale.
        targets: `(N, a)`, on one scale.
        fold: 0 to F − 1 of each point, `(N,)`, three folds or more.
        landmarks: Which points the smooth part is made of; 256 of 4000 are enough.
    """
    centres = inputs[landmarks]
    typical = float(np.median(pdist(centres))) or 1.0
    least = np.full((fold.max() + 1, targets.shape[1]), np.inf)  # error on the validation fold so far
    predicted = np.zeros_like(targets)
    for length in _LENGTHS:
        features = _features(inputs, centres, length * typical)
        for held, checked, found in _fits(features, targets, fold):
            better = checked < least[held]
            least[held] = np.where(better, checked, least[held])
            rows = np.flatnonzero(fold == held)
            predicted[np.ix_(rows, better)] = found[:, better]
    return predicted


def _features(inputs: FloatArray, centres: FloatArray, length: float) -> FloatArray:
    """Return φ with φᵀφ' the kernel, and a constant, `(N, m + s + 1)`."""

    def kernel(points: FloatArray) -> FloatArray:
        return np.exp(-0.5 * cdist(points, centres, "sqeuclidean") / length**2)

    among = kernel(centres) + _JITTER * np.eye(len(centres))
    smooth = solve_triangular(cholesky(among, lower=True), kernel(inputs).T, lower=True).T
    return np.hstack([smooth, inputs / np.sqrt(inputs.shape[1]), np.ones((len(inputs), 1))])


def _fits(
    features: FloatArray, targets: FloatArray, fold: IntArray
) -> Iterator[tuple[int, FloatArray, FloatArray]]:
    """Yield for each fold and ridge: which, squared errors on the fold after it, predictions of it."""
    count, size = fold.max() + 1, features.shape[1]
    rows = [np.flatnonzero(fold == each) for each in range(count)]
    grams = np.stack([features[each].T @ features[each] for each in rows])
    moments = np.stack([features[each].T @ targets[each] for each in rows])
    for held in range(count):
        after = (held + 1) % count
        for ridge in _RIDGES:

            def fit(*without: int, ridge: float = ridge) -> FloatArray:
                used = [each for each in range(count) if each not in without]
                weight = ridge * sum(len(rows[each]) for each in used)
                gram = grams[used].sum(axis=0) + weight * np.eye(size)
                return cho_solve(cho_factor(gram, lower=True), moments[used].sum(axis=0))

            checked = features[rows[after]] @ fit(held, after) - targets[rows[after]]
            yield held, (checked**2).sum(axis=0), features[rows[held]] @ fit(held)

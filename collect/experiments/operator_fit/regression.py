"""Ridge regression of what made data on statistics of the data, its strength by leaving one out."""

from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray

_STRENGTHS = np.logspace(0.0, 4.0, 14)
_FARTHEST = 4.0  # standard deviations to which a statistic is cut


@dataclass(frozen=True)
class Regression:
    """`θ ≈ θ̄ + W φ(s)`, φ the standardised statistics, and their squares where that predicts better.

    Attributes:
        mean: of the statistics, (s,).
        scale: their standard deviation, ∞ where nothing varies, (s,).
        centre: of φ, (2 s,).
        weights: W transposed, (2 s, p).
        offset: θ̄, (p,).
        residuals: of each sample by the others, (N, p).
    """

    mean: FloatArray
    scale: FloatArray
    centre: FloatArray
    weights: FloatArray
    offset: FloatArray
    residuals: FloatArray

    @classmethod
    def of(cls, statistics: FloatArray, values: FloatArray) -> "Regression":
        """Return the regression of values, (N, p), on statistics, (N, s)."""
        mean, spread = statistics.mean(axis=0), statistics.std(axis=0)
        scale = np.where(spread > 1e-9, spread, np.inf)
        found = _features(statistics, mean, scale)
        centre, offset = found.mean(axis=0), values.mean(axis=0)
        count, size = statistics.shape[1], values.shape[1]
        weights, residuals = np.zeros((2 * count, size)), values - offset
        best = np.full(size, np.inf)
        for columns in (count, 2 * count):
            left, singular, right = np.linalg.svd((found - centre)[:, :columns], full_matrices=False)
            for strength in _STRENGTHS:
                shrunk = singular / (singular**2 + strength)
                solved = right.T @ (shrunk[:, None] * (left.T @ (values - offset)))
                fitted = left**2 @ (shrunk * singular) + 1.0 / len(values)
                missed = values - offset - (found - centre)[:, :columns] @ solved
                missed = missed / (1.0 - fitted)[:, None]
                better = np.mean(missed**2, axis=0) < best
                best[better] = np.mean(missed**2, axis=0)[better]
                weights[:, better] = 0.0
                weights[:columns, better] = solved[:, better]
                residuals[:, better] = missed[:, better]
        return cls(mean, scale, centre, weights, offset, residuals)

    def predict(self, statistics: FloatArray) -> FloatArray:
        """Return what made statistics, (…, s), as far as they tell, (…, p)."""
        found = _features(statistics, self.mean, self.scale)
        return self.offset + (found - self.centre) @ self.weights


def _features(statistics: FloatArray, mean: FloatArray, scale: FloatArray) -> FloatArray:
    standard = np.clip((statistics - mean) / scale, -_FARTHEST, _FARTHEST)
    return np.concatenate([standard, standard**2], axis=-1)

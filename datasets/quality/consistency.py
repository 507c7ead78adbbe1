"""How alike the episodes of a dataset act in like situations, and how much of the space they cover."""

import numpy as np
from scipy.special import digamma, gammaln

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.quality.missing import DoesNotApply
from handrail.datasets.quality.neighbours import nearest

RESOLUTION = 1e-3  # of the scale: states that are nearer are one state


def action_variance(states: FloatArray, actions: FloatArray, owner: IntArray, k: int = 5) -> FloatArray:
    """Return tr Cov(a_j : j ∈ kNN(s_i)), neighbours from other episodes, for each frame i.

    The dataset's value is the mean over the frames. With actions of unit variance that do not depend on the
    state it is their dimension; where the state alone decides, it goes to zero with the frames' distance.
    Not monotone in quality: the worst operators can have the lowest. Source: Belkhale et al. 2023, "Data
    quality in imitation learning" (action consistency).

    Args:
        states: `(N, s)`, on one scale.
        actions: `(N, a)`, on one scale.
        owner: Which episode a frame is from, `(N,)`.
        k: How many neighbours; the covariance is the unbiased one.

    Returns:
        `(N,)`, in units of the pooled variance; NaN where other episodes have fewer than k frames.

    Raises:
        DoesNotApply: There is only one episode.
    """
    if len(np.unique(owner)) < 2:
        raise DoesNotApply("there is only one episode")
    if len(states) <= k:
        raise DoesNotApply(f"there are only {len(states)} frames")
    places, distances = nearest(states, k, owner)
    spread = actions[places].var(axis=1, ddof=1).sum(axis=1)
    return np.where(np.isfinite(distances[:, -1]), spread, np.nan)


def state_coverage(states: FloatArray, k: int = 5) -> FloatArray:
    """Return each frame's part of the Kozachenko–Leonenko entropy of the states; the dataset's is the mean.

    H = ψ(N) − ψ(k) + log c_d + d · mean_i log r_k(i), c_d the volume of the unit ball and r_k the distance
    to the k-th neighbour: 0 for a uniform unit cube, more where more is covered. Its relation to quality is
    an inverted U. States nearer than a thousandth of the scale count as that far apart, since a robot at
    rest would make the entropy −∞. Source: Kozachenko & Leonenko 1987; Kraskov et al. 2004, eq. 20.

    Args:
        states: `(N, d)`, on one scale.
        k: Which neighbour.

    Returns:
        `(N,)` [nat].

    Raises:
        DoesNotApply: There are no more than k frames.
    """
    count, size = states.shape
    if count <= k:
        raise DoesNotApply(f"there are only {count} frames")
    radius = np.maximum(nearest(states, k)[1][:, -1], RESOLUTION)
    ball = 0.5 * size * np.log(np.pi) - gammaln(0.5 * size + 1.0)
    return digamma(count) - digamma(k) + ball + size * np.log(radius)

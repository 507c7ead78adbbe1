"""How alike episodes act in like situations, how much space they cover, what the state says of the action.

The unit of all of these is the dataset. Each takes frames that stand for it; `DoesNotApply` for too few.
"""

import numpy as np
from scipy.spatial.distance import cdist
from scipy.special import digamma, gammaln

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.quality.episode_set import EpisodeSet
from handrail.datasets.quality.metric import metric
from handrail.datasets.reading.demonstration import DoesNotApply

RESOLUTION = 1e-3  # of the scale: states that are nearer are one state
_COMPONENTS = 8  # principal components at most, of what a policy reads and does
_NEIGHBOURS = 5
_KS = (5, 6, 7)
_BATCH = 1024


@metric("σ²", "", "scale", of_dataset=True)
def action_variance(dataset: EpisodeSet, rng: np.random.Generator) -> FloatArray:
    """Spread of actions in like states of other episodes; falls with their number, no rank of quality."""
    states, actions = dataset.points("observation", _COMPONENTS), dataset.points("relative_action")
    return neighbour_variance(states, actions, dataset.owner)


@metric("nat", "", "scale", of_dataset=True)
def state_coverage(dataset: EpisodeSet, rng: np.random.Generator) -> FloatArray:
    """Entropy of the configurations: too little and too much are both bad; for groups of the same size."""
    return entropy(dataset.points("configuration"))


@metric("nat", "higher", "scale", "mutual information", of_dataset=True)
def information(dataset: EpisodeSet, rng: np.random.Generator) -> FloatArray:
    """Mutual information of state and action (DemInf): actions varied and predictable at once."""
    states = dataset.points("observation", _COMPONENTS)
    return mutual_information(states, dataset.points("relative_action", _COMPONENTS), rng)


def neighbour_variance(states: FloatArray, actions: FloatArray, owner: IntArray) -> FloatArray:
    """Return tr Cov(a_j : j ∈ 5NN(s_i)), neighbours from other episodes, for each frame i, `(N,)`.

    The dataset's value is the mean over the frames. With actions of unit variance that do not depend on the
    state it is their dimension; where the state alone decides, it goes to zero with the frames' distance.
    Not monotone in quality: the worst operators can have the lowest. Source: Belkhale et al. 2023, "Data
    quality in imitation learning" (action consistency).

    Args:
        states: `(N, s)`, on one scale.
        actions: `(N, a)`, on one scale: the result is in units of the pooled variance.
        owner: Which episode a frame is from, `(N,)`; NaN results where the others have too few frames.
    """
    if len(np.unique(owner)) < 2:
        raise DoesNotApply("there is only one episode")
    places, radius = _nearest(states, owner)
    spread = actions[places].var(axis=1, ddof=1).sum(axis=1)
    return np.where(np.isfinite(radius), spread, np.nan)


def entropy(states: FloatArray) -> FloatArray:
    """Return each frame's part of the entropy of states `(N, d)` [nat], `(N,)`; the dataset's is the mean.

    Kozachenko–Leonenko: H = ψ(N) − ψ(k) + log c_d + d · mean_i log r_k(i), c_d the volume of the unit ball
    and r_k the distance to the k-th neighbour, the fifth: 0 for a uniform unit cube, more where more is
    covered. Its relation to quality is an inverted U. States nearer than a thousandth of the scale count as
    that far apart, since a robot at rest would make the entropy −∞. Source: Kozachenko & Leonenko 1987;
    Kraskov et al. 2004, eq. 20.
    """
    count, size = states.shape
    radius = np.maximum(_nearest(states, np.arange(count))[1], RESOLUTION)
    ball = 0.5 * size * np.log(np.pi) - gammaln(0.5 * size + 1.0)
    return digamma(count) - digamma(_NEIGHBOURS) + ball + size * np.log(radius)


def mutual_information(states: FloatArray, actions: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return each frame's part of I(s; a) [nat], `(N,)`, clipped to its 1st to 99th percentile.

    Î = ψ(k) + ψ(N) − ⟨ψ(n_s + 1) + ψ(n_a + 1)⟩, the first estimator of Kraskov, Stögbauer & Grassberger
    2004, in random batches of about 1024 frames and averaged over k = 5, 6, 7. Its mean over an episode is
    the score of Hejna et al. 2025, "Robot data curation with mutual information estimators" (DemInf). Frames
    nearer than a thousandth of the scale are one: k is then their number (Gao et al. 2017), else a robot at
    rest would tell most. For
    two normal numbers of correlation ρ it is −½ log(1 − ρ²); for independent ones 0.

    Args:
        states: `(N, s)`, on one scale; few dimensions, since the estimate falls short in many.
        actions: `(N, a)`, on one scale; relative ones work best.
        rng: Of the batches.
    """
    if len(states) <= max(_KS) + 1:
        raise DoesNotApply(f"there are only {len(states)} frames")
    order = rng.permutation(len(states))
    parts = np.empty(len(states))
    for batch in np.array_split(order, max(1, round(len(order) / _BATCH))):
        parts[batch] = _information_of(states[batch], actions[batch])
    return np.clip(parts, *np.percentile(parts, [1, 99]))


def _information_of(states: FloatArray, actions: FloatArray) -> FloatArray:
    apart, acted = cdist(states, states, "chebyshev"), cdist(actions, actions, "chebyshev")
    for distances in (apart, acted):
        np.fill_diagonal(distances, np.inf)
    count, ks, both = len(states), [k - 1 for k in _KS], np.maximum(apart, acted)
    alike, parts = np.count_nonzero(both < RESOLUTION, axis=1), []
    for k, radius in zip(_KS, np.partition(both, ks, axis=1)[:, ks].T, strict=True):
        near, wide = np.where(radius < RESOLUTION, alike, k), np.maximum(radius, RESOLUTION)
        parts.append(digamma(near) + digamma(count))
        parts[-1] -= digamma(_within(apart, wide)) + digamma(_within(acted, wide))
    return np.mean(parts, axis=0)


def _within(distances: FloatArray, radius: FloatArray) -> FloatArray:
    """Return 1 + how many others are strictly nearer than the radius, `(N,)`."""
    return 1.0 + np.count_nonzero(distances < radius[:, None], axis=1)


def _nearest(points: FloatArray, owner: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the five nearest points of other owners, `(N, 5)`, and how far the fifth is, ∞ without one."""
    if len(points) <= _NEIGHBOURS:
        raise DoesNotApply(f"there are only {len(points)} frames")
    distance = cdist(points, points)
    distance[owner[:, None] == owner] = np.inf
    places = np.argpartition(distance, _NEIGHBOURS - 1, axis=1)[:, :_NEIGHBOURS]
    return places, np.take_along_axis(distance, places, axis=1).max(axis=1)

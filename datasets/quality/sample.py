"""Frames that stand for a group of episodes, where every frame is compared with every other."""

from collections.abc import Callable, Sequence

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.reading.demonstration import Demonstration


class Sample:
    """Some frames of some episodes of a group.

    Attributes:
        episodes: What is left of each.
        places: Which episodes of the group they are.
    """

    def __init__(self) -> None:
        """Begin without a frame."""
        self.episodes: list[Demonstration] = []
        self.places: list[int] = []

    def add(self, episode: Demonstration, frames: IntArray, place: int) -> None:
        """Take some frames of an episode in, if there are any."""
        if len(frames):
            self.episodes.append(episode.some(frames))
            self.places.append(place)

    def points(self, read: Callable[[Demonstration], FloatArray]) -> FloatArray:
        """Return what is read of all frames, `(N, d)`."""
        return np.vstack([read(episode) for episode in self.episodes])

    @property
    def owner(self) -> IntArray:
        """Which episode of the group a frame is from, `(N,)`."""
        return np.repeat(self.places, [episode.count for episode in self.episodes])

    def mean_of_each(self, values: FloatArray, count: int) -> FloatArray:
        """Return the mean of the frames' values for each of E = `count` episodes, NaN where it has none."""
        known, owner = np.isfinite(values), self.owner
        counts = np.bincount(owner[known], minlength=count)
        sums = np.bincount(owner[known], weights=values[known], minlength=count)
        return np.divide(sums, counts, out=np.full(count, np.nan), where=counts > 0)


def frames_of(lengths: Sequence[int], most: int) -> list[IntArray]:
    """Return which frames stand for each episode: evenly spaced, as many of all that are long enough.

    Args:
        lengths: Of the episodes of one group [frames].
        most: Frames of all episodes together; all of them where there are fewer.
    """
    whole = np.array(lengths)
    shares, left = np.zeros_like(whole), min(most, int(whole.sum()))
    order = np.argsort(whole, kind="stable")
    for done, place in enumerate(order):  # the shorter ones whole, the rest alike, ±1
        shares[place] = min(int(whole[place]), left // (len(order) - done))
        left -= int(shares[place])
    pairs = zip(whole, shares, strict=True)
    return [np.linspace(0, length - 1, share).round().astype(int) for length, share in pairs]

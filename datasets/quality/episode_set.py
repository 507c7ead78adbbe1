"""The episodes of one group that is compared, and what reading them one after the other gave."""

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.quality.scale import Scale, embed
from handrail.datasets.reading.demonstration import Demonstration, Episode
from handrail.datasets.reading.load import each_opened

_GOLDEN = 0.618  # multiples of it are evenly spread, modulo 1
_SOME = 200  # episodes that stand for all of them where sizes are told apart


class EpisodeSet:
    """Episodes of one dataset."""

    def __init__(self, episodes: Sequence[Episode]):
        """Begin with nothing read."""
        self.episodes = episodes
        self.scale = Scale()  # shared with the groups that these can be compared with
        self.modes: set[str] = set()  # that the frames name
        # by metric, of each episode: its value, or why it has none
        self.found: dict[str, list[float | str]] = {}
        self.frames: list[IntArray] = []  # that stand for each
        self.excerpts: dict[int, Demonstration] = {}  # these frames, by place in `episodes`

    @cached_property
    def first(self) -> Demonstration:
        """The first episode."""
        return next(each_opened(self.episodes[:1]))

    def rows(self, part: str) -> FloatArray:
        """Return the numbers of a part of some episodes, `(N, d)`, evenly chosen where there are many."""
        return np.vstack([episode.matrix(part) for episode in self._some()])

    def followed(self) -> tuple[FloatArray, FloatArray]:
        """Return what was commanded and what was reached of it, `(N, p)`, of the same episodes."""
        commanded, reached = zip(*((each.commanded, each.reached) for each in self._some()), strict=True)
        return np.vstack(commanded), np.vstack(reached)

    def _some(self) -> Iterator[Demonstration]:
        count = len(self.episodes)
        places = np.unique(np.linspace(0, count - 1, min(_SOME, count)).round().astype(int))
        return each_opened(self.episodes[place] for place in places.tolist())

    def points(self, part: str, most: int | None = None) -> FloatArray:
        """Return a part of all excerpts, `(N, m)`, mapped as `embed` says."""
        mapped = embed(self.scale.part(part), most)
        return np.vstack([mapped(getattr(each, part)) for each in self.excerpts.values()])

    @property
    def owner(self) -> IntArray:
        """The place of the episode that each frame of the excerpts is from, `(N,)`."""
        return np.repeat(list(self.excerpts), [each.count for each in self.excerpts.values()])


def frames_of(lengths: Sequence[int], most: int) -> list[IntArray]:
    """Return which frames stand for each episode: evenly spaced, as many of all that are long enough.

    Few frames begin at another part of each episode, so that together they are of all parts alike.

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
    return [
        ((np.arange(share) + _GOLDEN * place % 1.0) * length / max(share, 1)).astype(int)
        for place, (length, share) in enumerate(zip(whole, shares, strict=True))
    ]

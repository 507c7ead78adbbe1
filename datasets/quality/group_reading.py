"""What is known of a group of episodes that were read one after the other."""

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.metric import Metric
from handrail.datasets.quality.pool import ObservationPool, Sample
from handrail.datasets.reading.demonstration import Demonstration
from handrail.datasets.reading.episode import Episode
from handrail.datasets.reading.load import each_opened

_SOME = 200  # episodes that stand for all of them where sizes are told apart


class GroupReading:
    """What is known of a group of episodes.

    Attributes:
        episodes: Of the group.
        pool: Of its scale; which groups share one is decided before they are read.
        number: Of the pool.
        values: By metric, `(E,)`; NaN where it does not apply.
        reasons: By metric, why it does not apply, and to how many.
        modes: The teleop modes that the frames name.
        sample: Frames that stand for all, for the metrics of a group.
    """

    def __init__(self, episodes: Sequence[Episode], metrics: Sequence[Metric] = ()):
        """Begin with nothing read."""
        self.episodes = episodes
        self.pool, self.number = ObservationPool(), 0
        measured = [metric.name for metric in metrics if not metric.of_group]
        self.values = {name: np.full(len(episodes), np.nan) for name in measured}
        self.reasons: dict[str, Counter[str]] = {name: Counter() for name in measured}
        self.modes: set[str] = set()
        self.sample = Sample()

    @cached_property
    def first(self) -> Demonstration:
        """The first episode."""
        return next(each_opened(self.episodes[:1]))

    def rows(self, part: str) -> FloatArray:
        """Return the numbers of a part of some episodes, `(N, d)`, evenly chosen where there are many."""
        return np.vstack([episode.matrix(part) for episode in self._some()])

    def followed(self) -> tuple[FloatArray, FloatArray]:
        """Return what was commanded and what was reached of it, `(N, p)`, of the same episodes."""
        pairs = [(episode.commanded, episode.reached) for episode in self._some()]
        commanded, reached = zip(*pairs, strict=True)
        return np.vstack(commanded), np.vstack(reached)

    def _some(self) -> Iterator[Demonstration]:
        count = len(self.episodes)
        places = np.unique(np.linspace(0, count - 1, min(_SOME, count)).round().astype(int))
        return each_opened(self.episodes[place] for place in places.tolist())

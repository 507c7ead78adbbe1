"""Going back to the moment at which the operator paused last, or to the beginning."""

from copy import copy

from handrail.collect.session.loop import EpisodeLoop
from handrail.collect.session.rate import Sampling


class Undo:
    """Wraps the loop of an episode that has begun: what came after the last mark can be forgotten.

    Args:
        loop: of the episode.
        sampling: of its recording.
    """

    def __init__(self, loop: EpisodeLoop, sampling: Sampling) -> None:
        self._loop = loop
        self._take(sampling)

    @property
    def safe(self) -> int:
        """The number of recorded frames that no undo takes back."""
        return self._sampling.number

    def mark(self, sampling: Sampling) -> None:
        """Take note of this moment, to come back to; the robot rests."""
        if self._moved:
            self._take(sampling)

    def back(self, sampling: Sampling) -> Sampling:
        """Go back to the last mark; return the recording's sampling of then."""
        if not self._moved:
            return sampling
        self._loop.restore(self._world)
        return copy(self._sampling)

    @property
    def _moved(self) -> bool:
        return self._loop.tally.frames > self._frames

    def _take(self, sampling: Sampling) -> None:
        self._world, self._frames = self._loop.checkpoint(), self._loop.tally.frames
        self._sampling = copy(sampling)

"""Which moments a policy learns from where a person took over from another one, and how often each is drawn.

`only`: HG-DAgger, of what a person commanded (Kelly et al. 2019, "HG-DAgger: interactive imitation learning
with human experts"). `weighted`: intervention-weighted regression, corrections as often as all else together
(Mandlekar et al. 2020, "Human-in-the-loop imitation learning using remote teleoperation").
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from handrail.controllers.arrays import BoolArray, IntArray
from handrail.controllers.errors import HandrailError
from handrail.datasets.reading.reader import DatasetInfo
from handrail.datasets.recording.frames import BY_PERSON, INTERVENTION, OWNER

Kind = Literal["all", "only", "weighted"]
Read = Callable[[Sequence[str]], Iterable[Mapping[str, np.ndarray]]]


def corrected(kind: Kind, info: DatasetInfo, read: Read) -> BoolArray:
    """Return which frames count as corrections, (N,).

    With `only` that is all that a person commanded, demonstrations that were merged in as well; with
    `weighted` only what they took over from a policy.

    Args:
        kind: how they are learnt from.
        info: of the dataset; one of LeRobot's own may say that somebody intervened, and not what they owned.
        read: yields columns of the episodes to learn from.
    """
    if INTERVENTION not in info.features:
        words = f"expected a column {INTERVENTION!r} in {str(info.root)!r}, found none"
        raise HandrailError(f"--corrections {kind}: {words}; no policy drove beside a person there")
    if kind == "only" and OWNER in info.features:
        parts = [np.any(each[OWNER] >= BY_PERSON, axis=1) for each in read([OWNER])]
    else:
        parts = [each[INTERVENTION].astype(bool) for each in read([INTERVENTION])]
    return np.concatenate(parts)


@dataclass(frozen=True)
class Draws:
    """The frames of some episodes that samples begin with."""

    kind: Kind
    lengths: tuple[int, ...]
    """Frames of each episode."""
    marked: BoolArray
    """Which are corrections, (N,)."""

    def __post_init__(self) -> None:
        """Check that there is something to learn from."""
        count, size = np.count_nonzero(self.marked), len(self.marked)
        if self.kind != "all" and (count == 0 or (count == size and self.kind == "weighted")):
            words = "of a person" if self.kind == "only" else "with and without a correction"
            raise HandrailError(f"--corrections {self.kind}: expected frames {words}, got {count} of {size}")

    @cached_property
    def ends(self) -> tuple[IntArray, IntArray]:
        """The first and the last frame that a sample's actions are from, (N,) each.

        They end with the episode, or with the correction where nothing else is learnt: what the policy did
        after it is no example.
        """
        first = np.zeros(sum(self.lengths), bool)
        first[np.cumsum((0, *self.lengths[:-1]))] = True
        if self.kind == "only":
            first[1:] |= self.marked[1:] != self.marked[:-1]
        starts = np.flatnonzero(first)
        counts = np.diff(starts, append=len(first))
        return np.repeat(starts, counts), np.repeat(starts + counts - 1, counts)

    def frames(self, dropped: int = 0) -> IntArray:
        """Return the frames of an epoch, each as often as it counts.

        Args:
            dropped: how many at the end of each episode, or correction, no sample begins with.
        """
        kept = np.arange(len(self.marked))
        kept = kept[self.ends[1] - kept >= dropped]
        if self.kind == "all":
            return kept
        marked = self.marked[kept]
        if self.kind == "only":
            return kept[marked]
        classes = kept[marked], kept[~marked]
        count = max(map(len, classes)) if all(map(len, classes)) else 0
        # the fewer ones again and again, evenly: what is next to each other is drawn about as often
        return np.concatenate([each[np.arange(count) * len(each) // max(count, 1)] for each in classes])

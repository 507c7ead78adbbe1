"""Frames of some episodes of a group, spread evenly: no more than are needed, however large the dataset."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.datasets.demonstrations.demonstration import Demonstration, DoesNotApply
from handrail.datasets.demonstrations.episode import Episode
from handrail.datasets.demonstrations.load import each_opened
from handrail.datasets.learnability.candidates import PREVIOUS, before, hidden_variables
from handrail.datasets.learnability.policy_rows import Actions, PolicyRows, PolicyView
from handrail.datasets.quality.sample import frames_of

EPISODES, FRAMES = 200, 4000  # of a group at most
FEWEST = 6  # episodes
_LEAST = 50  # frames
_THIRDS = ("first third", "second third", "last third")


@dataclass(frozen=True)
class Budget:
    """How much of each group is looked at: as much of one as of another."""

    episodes: int = EPISODES
    frames: int = FRAMES


@dataclass(frozen=True)
class Sample:
    """Frames of episodes.

    Attributes:
        seen: What a policy reads, `(N, s)`.
        actions: By action space.
        hidden: By candidate, `(N, h)`, whether it is seen or not.
        shown: Which columns of `seen` say what candidate.
        phase: Name of each frame's phase, `(N,)`.
        owner: Which episode each frame is from, 0 to E − 1, `(N,)`.
    """

    seen: FloatArray
    actions: Mapping[str, Actions]
    hidden: Mapping[str, FloatArray]
    shown: Mapping[str, tuple[int, ...]]
    phase: np.ndarray
    owner: IntArray

    @property
    def episodes(self) -> int:
        """Their number E."""
        return int(self.owner.max()) + 1


def shared_budget(groups: Sequence[Sequence[Episode]]) -> Budget:
    """Return as much as the smallest of some groups has, and no more than is needed."""
    episodes = min(EPISODES, *(len(group) for group in groups))
    means = [sum(episode.count for episode in group) / len(group) for group in groups]
    return Budget(episodes, min(FRAMES, int(episodes * min(means))))


def take(episodes: Sequence[Episode], view: PolicyView, budget: Budget, rng: np.random.Generator) -> Sample:
    """Return frames of randomly chosen episodes; the order in which these are given does not matter.

    Args:
        episodes: Of one group; only those chosen are read.
        view: What a policy reads and writes.
        budget: How many episodes and frames at most.
        rng: Of the choice.

    Raises:
        DoesNotApply: There are too few episodes, or one holds nothing that a policy could learn.
    """
    if min(len(episodes), budget.episodes) < FEWEST:
        raise DoesNotApply(f"there are fewer than {FEWEST} episodes")
    order = sorted(range(len(episodes)), key=lambda place: episodes[place].number)
    drawn = np.sort(rng.permutation(len(order))[: budget.episodes])
    chosen = [episodes[order[place]] for place in drawn]
    frames = frames_of([episode.count for episode in chosen], budget.frames)
    if sum(map(len, frames)) < _LEAST:
        raise DoesNotApply(f"there are fewer than {_LEAST} frames")
    opened = zip(each_opened(chosen), frames, strict=True)  # one in memory at a time
    taken = [_taken(episode, view(episode), each) for episode, each in opened]
    first = taken[0]
    if any(each.shape != first.shape for each in taken):
        raise DoesNotApply("its episodes do not all hold the same")
    return Sample(
        seen=np.vstack([each.seen for each in taken]),
        actions={
            space: Actions(actions.names, np.vstack([each.actions[space].values for each in taken]))
            for space, actions in first.actions.items()
        },
        hidden={name: np.vstack([each.hidden[name] for each in taken]) for name in first.hidden},
        shown=first.shown,
        phase=np.concatenate([each.phase for each in taken]),
        owner=np.repeat(np.arange(len(taken)), [len(each) for each in frames]),
    )


@dataclass(frozen=True)
class _Taken:
    """What `Sample` has, of one episode."""

    seen: FloatArray
    actions: Mapping[str, Actions]
    hidden: Mapping[str, FloatArray]
    shown: Mapping[str, tuple[int, ...]]
    phase: np.ndarray

    @property
    def shape(self) -> tuple[object, ...]:
        """Names and sizes of what there is."""
        hidden = [(name, values.shape[1]) for name, values in self.hidden.items()]
        return (
            self.seen.shape[1],
            self.shown,
            [(space, each.names) for space, each in self.actions.items()],
            hidden,
        )


def _taken(episode: Demonstration, rows: PolicyRows, frames: IntArray) -> _Taken:
    done = np.hstack([before(each.values) for each in rows.actions.values()])
    hidden = {name: each[frames] for name, each in {**hidden_variables(episode), PREVIOUS: done}.items()}
    actions = {space: Actions(each.names, each.values[frames]) for space, each in rows.actions.items()}
    return _Taken(rows.seen[frames], actions, hidden, rows.shown, _phases(episode)[frames])


def _phases(episode: Demonstration) -> np.ndarray:
    """Return the recorded phase of each frame, or else which third of the episode it is in, `(N,)`."""
    if episode.has("phase"):
        return episode.column("phase").reshape(episode.count, -1)[:, 0].astype(str)
    thirds = np.arange(episode.count) * len(_THIRDS) // episode.count
    return np.array(_THIRDS)[thirds]

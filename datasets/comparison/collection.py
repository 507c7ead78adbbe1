"""What was collected: how many episodes, in how much of an operator's time, and how many failed."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.proportions import ShareDifference, paired_difference, unpaired_difference
from handrail.datasets.comparison.resampling import Interval
from handrail.datasets.paired import wilson
from handrail.datasets.quality.demonstration import Demonstration

_SHARED = 0.8  # of the smaller group's seeds: from here on episodes are compared as pairs


@dataclass(frozen=True)
class Collected:
    """One group.

    Attributes:
        label: Its name.
        episodes: Number recorded.
        attempts: With those that were thrown away, where the metadata says (`attempts`); else `episodes`.
        successes: How many succeeded; None where success was not recorded for all.
        success_interval: Wilson, 95 %.
        operator_time: Of all episodes, failures included: frames over frames a second [s]. Resets between
            episodes are not recorded.
        frames: Number.
        reasons: Why episodes failed, and how many of each.
    """

    label: str
    episodes: int
    attempts: int
    successes: int | None
    success_interval: Interval | None
    operator_time: float
    frames: int
    reasons: Mapping[str, int]

    @property
    def failure_share(self) -> float | None:
        """Share of the attempts that did not become a successful episode."""
        return None if self.successes is None else 1.0 - self.successes / self.attempts

    @property
    def successes_an_hour(self) -> float | None:
        """Of the operator's time."""
        return None if self.successes is None else 3600.0 * self.successes / self.operator_time


def collected(group: Group) -> Collected:
    """Return what a group consists of."""
    results = [episode.success for episode in group.episodes]
    known = all(result is not None for result in results)
    successes = sum(map(bool, results)) if known else None
    attempts = sum(_attempts(episode) for episode in group.episodes)
    reasons = Counter(
        str(episode.meta.get("failure_reason") or "not recorded")
        for episode in group.episodes
        if episode.success is False
    )
    return Collected(
        label=group.label,
        episodes=len(group.episodes),
        attempts=attempts,
        successes=successes,
        success_interval=None if successes is None else wilson(successes, attempts),
        operator_time=sum(episode.seconds for episode in group.episodes),
        frames=sum(episode.count for episode in group.episodes),
        reasons=dict(reasons.most_common()),
    )


def _attempts(episode: Demonstration) -> int:
    value = episode.meta.get("attempts")
    return max(1, int(value)) if isinstance(value, int | float) and np.isfinite(value) else 1


def shared_seeds(one: Group, other: Group) -> list[tuple[int, int]]:
    """Return places of episodes with the same start, as pairs; none where too few have one.

    Two episodes begin alike if task sentences and seed are the same. Seeds must be unique in each group.
    """
    places = [_starts(group) for group in (one, other)]
    common = [key for key in places[0] if key in places[1]]
    if len(common) < max(2.0, _SHARED * min(len(one.episodes), len(other.episodes))):
        return []
    return [(places[0][key], places[1][key]) for key in common]


def _starts(group: Group) -> dict[tuple[str, int], int]:
    keys = [(str(e.meta.get("tasks")), e.meta.get("seed")) for e in group.episodes]
    if len(set(keys)) < len(keys):
        return {}
    return {(task, seed): place for place, (task, seed) in enumerate(keys) if isinstance(seed, int)}


def success_difference(group: Group, baseline: Group) -> ShareDifference | None:
    """Return how success in collection differs from the baseline's; None where it was not recorded."""
    results = [[episode.success for episode in each.episodes] for each in (group, baseline)]
    if any(result is None for each in results for result in each):
        return None
    one, other = [list(map(bool, each)) for each in results]
    pairs = shared_seeds(group, baseline)
    if len(pairs) == len(one) == len(other):
        return paired_difference([one[i] for i, _ in pairs], [other[j] for _, j in pairs])
    return unpaired_difference(one, other)


def matched_number(groups: Sequence[Group]) -> list[Group]:
    """Return the first episodes of each group, as many as the smallest has."""
    count = min(len(group.episodes) for group in groups)
    return [group.first(count) for group in groups]


def matched_time(groups: Sequence[Group]) -> list[Group]:
    """Return the first episodes of each group that fit into the shortest group's operator time."""
    seconds = min(sum(episode.seconds for episode in group.episodes) for group in groups)
    return [group.within(seconds) for group in groups]

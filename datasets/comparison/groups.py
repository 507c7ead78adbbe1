"""The compared groups: whole datasets, or the episodes of datasets by a column of their metadata."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from handrail.controllers.errors import HandrailError, check_known
from handrail.datasets.reading.columns import ColumnNames
from handrail.datasets.reading.demonstration import Demonstration, Episode
from handrail.datasets.reading.load import each_opened, some_recorded
from handrail.datasets.reading.reader import DatasetInfo

FEWEST, MOST = 2, 8


@dataclass(frozen=True)
class Group:
    """Episodes of one dataset that belong together, in the order in which they were recorded."""

    label: str
    info: DatasetInfo
    episodes: tuple[Episode, ...]

    @property
    def tasks(self) -> tuple[str, ...]:
        """Task sentences of the episodes, in order of the alphabet."""
        return tuple(sorted({task for episode in self.episodes for task in episode.meta["tasks"]}))

    @property
    def seconds(self) -> float:
        """The operator's time, failures included, without the resets between episodes [s]."""
        return sum(episode.seconds for episode in self.episodes)

    @property
    def successes(self) -> int | None:
        """How many episodes succeeded; None where that was not recorded for all."""
        results = [episode.success for episode in self.episodes]
        return None if None in results else sum(map(bool, results))

    @property
    def content(self) -> dict[str, Any]:
        """The group's data: the entry in the JSON of the report."""
        failed = (episode for episode in self.episodes if episode.success is False)
        reasons = Counter(str(each.meta.get("failure_reason") or "not recorded") for each in failed)
        return {
            "episodes": len(self.episodes),
            "successes": self.successes,
            "operator_time": self.seconds,
            "frames": sum(episode.count for episode in self.episodes),
            "reasons": dict(reasons.most_common()),
        }

    def first(self, count: int) -> "Group":
        """Return the first episodes only."""
        return replace(self, episodes=self.episodes[:count])

    def within(self, seconds: float) -> "Group":
        """Return the first episodes that fit into an operator's time [s], one at least."""
        ends = np.cumsum([episode.seconds for episode in self.episodes])
        return self.first(max(1, int(np.searchsorted(ends, seconds * (1.0 + 1e-9), side="right"))))

    def successful(self) -> "Group":
        """Return the episodes that are not known to have failed."""
        return replace(self, episodes=tuple(each for each in self.episodes if each.success is not False))


def load_groups(
    roots: Sequence[str | Path], by: str = "", labels: Sequence[str] = (), columns: ColumnNames | None = None
) -> list[Group]:
    """Return the groups of LeRobot v3.0 datasets.

    Args:
        roots: Folders of the datasets.
        by: Split each by this column of its episodes' metadata, such as `mode`, `operator` or `success`.
        labels: A name for each dataset; their folders' names when empty.
        columns: Which column plays which part.
    """
    groups: list[Group] = []
    for root, name in zip(roots, _names(roots, labels), strict=True):
        episodes = some_recorded(root, columns)
        prefix = f"{name} · " if len(roots) > 1 else ""
        values = (
            [prefix + value for value in _values(episodes, by, str(root))] if by else [name] * len(episodes)
        )
        members: dict[str, list[Episode]] = {}
        for episode, value in zip(episodes, values, strict=True):
            members.setdefault(value, []).append(episode)
        groups += [Group(label, episodes[0].info, tuple(each)) for label, each in members.items()]
    if not FEWEST <= len(groups) <= MOST:
        found = ", ".join(group.label for group in groups) or "none"
        advice = "" if by else "; name another dataset, or say --by mode"
        raise HandrailError(f"compare: expected {FEWEST} to {MOST} groups of episodes, got {found}{advice}")
    return groups


def baseline_of(labels: Sequence[str], name: str) -> str:
    """Return the label that the others are compared with: the first when `name` is ""."""
    check_known("baseline", filter(None, (name,)), labels)
    return name or labels[0]


def group_of(condition: str, labels: Sequence[str]) -> str:
    """Return the group whose data a condition's policies saw: the longest label it begins with, or ""."""
    known = (label for label in labels if f"{condition} ".startswith((f"{label} ", f"{label}/")))
    return max(known, key=len, default="")


def unlike(groups: Sequence[Group]) -> tuple[str, ...]:
    """Return which of tasks and robots differ: then no difference can be laid to how they were recorded."""
    read = {"tasks": [each.tasks for each in groups], "robots": [each.info.robot_type for each in groups]}
    return tuple(name for name, found in read.items() if len(set(found)) > 1)


def _names(roots: Sequence[str | Path], labels: Sequence[str]) -> list[str]:
    if labels and len(labels) != len(roots):
        raise HandrailError(f"--labels: expected {len(roots)} names, got {len(labels)}")
    paths = [Path(root).expanduser().absolute() for root in roots]
    names = list(labels) or [path.name for path in paths]
    if not labels and len(set(names)) < len(names):
        names = [f"{path.parent.name}/{path.name}" for path in paths]
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise HandrailError(f"compare: two datasets are called {twice[0]!r}; give each a name with --labels")
    return names


def _values(episodes: Sequence[Episode], by: str, root: str) -> list[str]:
    """Return the values of a metadata column; modes that the metadata lacks are read from the frames."""
    missing = by == "mode" and not all(by in episode.meta for episode in episodes)
    return [_value(episode, by, root) for episode in (each_opened(episodes) if missing else episodes)]


def _value(episode: Episode, by: str, root: str) -> str:
    known = [name for name in episode.meta if "/" not in name]
    if by in known:
        value = episode.meta[by]
        return "; ".join(map(str, value if isinstance(value, list) else [value])) or "none"
    if isinstance(episode, Demonstration) and by == "mode" and episode.has("mode"):
        return episode.modes or "none"
    raise HandrailError(f"dataset {root!r}: unknown column {by!r}, expected one of {', '.join(known)}")

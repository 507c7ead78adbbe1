"""Whether groups did the same task with the same robot: where not, nothing is ranked."""

from collections.abc import Callable, Sequence

from handrail.datasets.comparison.groups import Group

_SHOWN = 2  # task sentences of a group


def unlike(groups: Sequence[Group]) -> tuple[str, ...]:
    """Return what differs between groups so that no difference can be laid to how they were recorded."""
    return tuple(filter(None, (_differs("tasks", _tasks, groups), _differs("robots", _robot, groups))))


def _differs(what: str, read: Callable[[Group], tuple[str, ...]], groups: Sequence[Group]) -> str:
    found = {group.label: read(group) for group in groups}
    if len(set(found.values())) == 1:
        return ""
    told = "; ".join(f"{label}: {_told(names)}" for label, names in found.items())
    return f"The {what} differ ({told})"


def _told(names: Sequence[str]) -> str:
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(f"“{name}”" for name in names[:_SHOWN]) + more or "not recorded"


def _tasks(group: Group) -> tuple[str, ...]:
    return tuple(sorted({task for episode in group.episodes for task in episode.meta["tasks"]}))


def _robot(group: Group) -> tuple[str, ...]:
    return (group.info.robot_type,) if group.info.robot_type else ()

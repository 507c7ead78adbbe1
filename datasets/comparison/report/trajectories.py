"""Figures of the motion itself: where it went in every episode, and how fast in one of each group."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.report.figures import colours
from handrail.datasets.presentation.drawing import FAINT, GREY, Panel, new_figure, short, tidy
from handrail.datasets.quality.demonstration import Demonstration, DoesNotApply
from handrail.datasets.quality.naming import position_entries

_SHOWN = 50  # paths a group
_FAILED = "#b8bec6"
_SIZE = 5.2, 2.6  # [inch]
_LABEL = 30  # characters below axes


def trajectory_panels(comparison: Comparison) -> list[Panel]:
    """Return paths from above and speed over time of each group; none where no motion is recorded."""
    groups = [group for group in comparison.everything.groups if _has_motion(group)]
    known = colours(comparison)
    paths = [_paths(group, known[group.label]) for group in groups]
    speeds = [_speed(group, known[group.label]) for group in groups]
    for each in (paths, speeds):
        _same_limits(panel.figure.axes[0] for panel in each)
    return [panel for pair in zip(paths, speeds, strict=True) for panel in pair]


def _same_limits(axes: Iterable[Any]) -> None:
    """Give axes that show the same in the same unit the same limits."""
    alike: dict[tuple[str, str], list[Any]] = {}
    for each in axes:
        alike.setdefault((each.get_xlabel(), each.get_ylabel()), []).append(each)
    for members in alike.values():
        for part in ("xlim", "ylim"):
            limits = [getattr(each, f"get_{part}")() for each in members]
            for each in members:
                each.set(**{part: (min(low for low, _ in limits), max(high for _, high in limits))})


def example(group: Group) -> Demonstration:
    """Return the episode of median length, a successful one if there is any."""
    episodes = sorted(group.successful().episodes or group.episodes, key=lambda episode: episode.count)
    return episodes[len(episodes) // 2]


def _has_motion(group: Group) -> bool:
    try:
        return group.episodes[0].motion.shape[1] > 0
    except DoesNotApply:
        return False


def _paths(group: Group, colour: str) -> Panel:
    figure = new_figure(*_SIZE)
    axes = figure.subplots()
    for episode in group.episodes[:_SHOWN]:
        motion = episode.motion
        x, y = motion[:, 0], motion[:, 1] if motion.shape[1] > 1 else np.zeros(len(motion))
        line = _FAILED if episode.success is False else colour
        axes.plot(x, y, color=line, lw=1.0, alpha=0.7)
        axes.plot(x[-1], y[-1], "o", color=line, ms=3)
    first = group.episodes[0]
    names = ("tool x [m]", "tool y [m]") if first.motion_is_tool else _first_names(first)
    axes.set(xlabel=short(names[0], _LABEL), ylabel=short(names[1], _LABEL))
    if first.motion_is_tool:
        axes.set_aspect("equal", adjustable="box")
    tidy(axes)
    failed = ", grey: failed" if any(e.success is False for e in group.episodes) else ""
    return Panel(f"{group.label}: paths", figure, f"dot: end{failed}")


def _first_names(episode: Demonstration) -> tuple[str, str]:
    entries = episode.entries("state")
    moving = [entries[place] for place in position_entries(entries)] or entries
    names = [*moving, "first of the state", "second of the state"]
    return names[0], names[1]


def _speed(group: Group, colour: str) -> Panel:
    figure, episode = new_figure(*_SIZE), example(group)
    axes = figure.subplots()
    speed = episode.speed
    times = np.arange(len(speed)) / episode.fps
    axes.fill_between(times, speed, color=FAINT)
    axes.plot(times, speed, color=colour, lw=1.5)
    if episode.has("mode"):
        mode = episode.column("mode")
        for frame in np.flatnonzero(mode[1:] != mode[:-1]) + 1:
            axes.axvline(frame / episode.fps, color=GREY, lw=0.8, ls=":")
    unit = "m/s" if episode.motion_is_tool else "units of the state / s"
    axes.set(xlabel="s", ylabel=unit, xlim=(0, None), ylim=(0, None))
    tidy(axes)
    return Panel(f"{group.label}: speed", figure, f"in episode {episode.number}, of median length")

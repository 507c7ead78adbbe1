"""Figures of the motion itself: where it went in every episode, and how fast in one of each group."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.drawing import FAINT, GREY, new_figure, svg, tidy
from handrail.datasets.comparison.figures import colours
from handrail.datasets.comparison.groups import Group
from handrail.datasets.quality.demonstration import Demonstration
from handrail.datasets.quality.missing import DoesNotApply

_SHOWN = 50  # paths a group
_FAILED = "#b8bec6"


def trajectories_figure(comparison: Comparison) -> str:
    """Return paths from above and speed over time, one row a group; "" where no motion is recorded."""
    groups = [group for group in comparison.everything.groups if _has_motion(group)]
    if not groups:
        return ""
    known = colours(comparison)
    figure = new_figure(10.4, 0.3 + 2.5 * len(groups))
    grid = figure.subplots(len(groups), 2, squeeze=False, width_ratios=(1.0, 1.3))
    for (above, over_time), group in zip(grid, groups, strict=True):
        _paths(above, group, known[group.label])
        _speed(over_time, group, known[group.label])
    _same_limits([row[0] for row in grid])
    _same_limits([row[1] for row in grid])
    return svg(figure)


def _same_limits(axes: Sequence[Any]) -> None:
    for part in ("xlim", "ylim"):
        limits = [getattr(each, f"get_{part}")() for each in axes]
        for each in axes:
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


def _paths(axes: Any, group: Group, colour: str) -> None:
    for episode in group.episodes[:_SHOWN]:
        motion = episode.motion
        x, y = motion[:, 0], motion[:, 1] if motion.shape[1] > 1 else np.zeros(len(motion))
        line = _FAILED if episode.success is False else colour
        axes.plot(x, y, color=line, lw=1.0, alpha=0.7)
        axes.plot(x[-1], y[-1], "o", color=line, ms=3)
    first = group.episodes[0]
    names = ("tool x [m]", "tool y [m]") if first.motion_is_tool else _first_names(first)
    failed = ", grey: failed" if any(e.success is False for e in group.episodes) else ""
    axes.set(title=f"{group.label}: paths, dot: end{failed}", xlabel=names[0], ylabel=names[1])
    if first.motion_is_tool:
        axes.set_aspect("equal", adjustable="box")
    tidy(axes)


def _first_names(episode: Demonstration) -> tuple[str, str]:
    names = [*episode.entries("state"), "first of the state", "second of the state"]
    return names[0], names[1]


def _speed(axes: Any, group: Group, colour: str) -> None:
    episode = example(group)
    speed = np.linalg.norm(np.diff(episode.motion, axis=0), axis=1) * episode.fps
    times = np.arange(len(speed)) / episode.fps
    axes.fill_between(times, speed, color=FAINT)
    axes.plot(times, speed, color=colour, lw=1.5)
    if episode.has("mode"):
        mode = episode.column("mode")
        for frame in np.flatnonzero(mode[1:] != mode[:-1]) + 1:
            axes.axvline(frame / episode.fps, color=GREY, lw=0.8, ls=":")
    unit = "m/s" if episode.motion_is_tool else "units of the state / s"
    axes.set(
        title=f"{group.label}: speed in episode {episode.number}, of median length", xlabel="s", ylabel=unit
    )
    axes.set(xlim=(0, None), ylim=(0, None))
    tidy(axes)

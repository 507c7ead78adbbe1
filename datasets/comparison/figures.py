"""The figures of the page: the answer, how metrics differ and every episode, where the motion went.

Better is always right.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import cycle
from typing import Any

import numpy as np

from handrail.datasets.comparison.collection import SUCCESS
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.groups import Group
from handrail.datasets.presentation.drawing import GREY, Panel, new_figure, rows, short, tidy
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply
from handrail.datasets.reading.load import each_opened
from handrail.datasets.reading.naming import position_entries
from handrail.datasets.statistics.contrast import Contrast, Measure, Value

_WIDTH = 5.2  # [inch]
_LABEL, _SMALL_LABEL, _AXIS_LABEL = 26, 14, 30  # characters beside axes
TURNED = "↓"  # marks a metric of which less is better, drawn the other way round
_WIDEST = 4.0  # standard deviations that are shown
_SHOWN = 50  # paths a group
_FAILED = "#b8bec6"
_STYLES = {"solid": "-", "dashed": "--", "dotted": ":", "dash-dotted": "-."}  # of the hands' paths


def answer_panels(comparison: Comparison) -> list[Panel]:
    """Return success of the policies, or else in collection, and how it came about."""
    outcomes, groups = comparison.outcomes, comparison.everything.groups
    height = max(2.4, 1.0 + 0.4 * max(len(groups), len(outcomes.conditions) if outcomes else 0))
    return [_success(comparison, height), _over_time(comparison, height)]


def _success(comparison: Comparison, height: float) -> Panel:
    outcomes, title, note = comparison.outcomes, "Success while collecting", "95 % (Wilson)"
    found = [each for each in comparison.everything.collecting if each.measure is SUCCESS]
    if outcomes:
        found, title = list(outcomes.successes.values()), "Success of the policies"
        note = "95 %; thick: these policies, thin: with training too, ticks: each training seed"
    axes = new_figure(_WIDTH, height).subplots()
    draw_values(axes, found, [{"color": comparison.colours[each.label]} for each in found], 100.0)
    axes.set(xlabel="%", xlim=(-2, 102))
    rows(axes, [each.label for each in found], _LABEL)
    return Panel(title, axes.figure, note)


def draw_values(
    axes: Any, values: Sequence[Value], styles: Sequence[dict[str, Any]], scale: float = 1.0
) -> None:
    """Draw a row a value: the estimate, its intervals, and a tick for each unit.

    Args:
        axes: Of matplotlib.
        values: One a row.
        styles: How each is drawn: its color, perhaps its marker and label.
        scale: The factor of the numbers.
    """
    for row, (each, style) in enumerate(zip(values, styles, strict=True)):
        if each.estimate is None:
            place = {"transform": axes.get_yaxis_transform(), "ha": "center", "va": "center"}
            axes.text(0.5, row, "no value", color=GREY, size=7.5, **place)
            continue
        color, ticks = style["color"], scale * each.known
        axes.plot(ticks, np.full(len(ticks), row + 0.26), "|", color=color, ms=6, alpha=0.6)
        if each.nested and each.interval:
            axes.plot(np.multiply(scale, each.interval), [row, row], color=color, lw=5.0, alpha=0.35)
        if each.widest:
            axes.plot(np.multiply(scale, each.widest), [row, row], color=color, lw=1.8)
        axes.plot(scale * each.estimate, row, **{"marker": "o", "ms": 7, "mec": "white"} | style)


def _over_time(comparison: Comparison, height: float) -> Panel:
    axes, groups = new_figure(_WIDTH, height).subplots(), comparison.everything.collected
    unknown = any(episode.success is None for group in groups for episode in group.episodes)
    for group in groups:
        colour = comparison.colours[group.label]
        minutes = np.cumsum([0.0, *(episode.seconds for episode in group.episodes)]) / 60.0
        counts = np.cumsum([0, *(unknown or bool(episode.success) for episode in group.episodes)])
        axes.step(minutes, counts, where="post", color=colour, lw=1.8)
        axes.plot(minutes[-1], counts[-1], "o", color=colour, ms=5)
    what = "episodes" if unknown else "successes"
    axes.set(xlabel="min", ylabel=what, xlim=(0, None), ylim=(0, None))
    tidy(axes)
    return Panel(f"{what.capitalize()} over the operator's time", axes.figure)


def turned(metric: Measure, ranked: bool) -> bool:
    """Return whether a metric is drawn the other way round, so that right is better."""
    return ranked and metric.good == "lower"


def _called(metric: Measure, ranked: bool) -> str:
    return f"{metric.title} {TURNED}" if turned(metric, ranked) else metric.title


def effects_panels(comparison: Comparison) -> list[Panel]:
    """Return every metric's difference in standard deviations: those that can be better, then the others."""
    found = [each for each in comparison.everything.differences if each.interval]
    ranked, base = not comparison.unlike, comparison.baseline
    judged = [each for each in found if each.measure.good and ranked]
    rest = [each for each in found if each not in judged]
    drawn = {
        f"Right is better than {base}, left is worse": judged,
        f"Right is more than {base}, left is less: neither counts as good": rest,
    }
    return [Panel(title, _effects(each, comparison)) for title, each in drawn.items() if each]


def _effects(found: Sequence[Contrast], comparison: Comparison) -> Any:
    ranked, labels = not comparison.unlike, comparison.others
    metrics = list(dict.fromkeys(each.measure for each in found))
    axes = new_figure(8.4, 0.6 + 0.28 * len(metrics)).subplots()
    axes.axvline(0.0, color=GREY, lw=1.0)
    for each in found:
        row = metrics.index(each.measure) + 0.5 * ((labels.index(each.label) + 0.5) / len(labels) - 0.5)
        sign = -1.0 if turned(each.measure, ranked) else 1.0
        draw_effect(axes, each, row, comparison.colours[each.label], sign)
    axes.set(xlim=(-_WIDEST - 0.15, _WIDEST + 0.15), xlabel="difference in standard deviations, 95 %")
    rows(axes, [_called(metric, ranked) for metric in metrics])
    return axes.figure


def draw_effect(axes: Any, each: Contrast, row: float, colour: str, sign: float) -> None:
    """Draw a difference with its interval; what lies outside, or is infinite, is an arrow at the edge."""
    estimate, *ends = (sign * value for value in each.effect)
    low, high = sorted(ends)
    alpha, fill = (1.0, colour) if each.detected else (0.45, "white")
    axes.plot(np.clip([low, high], -_WIDEST, _WIDEST), [row, row], color=colour, lw=1.6, alpha=alpha)
    for value, ms in ((low, 5.0), (high, 5.0), (estimate, 7.5)):
        if abs(value) > _WIDEST:
            arrow = ">" if value > 0 else "<"
            axes.plot(np.copysign(_WIDEST, value), row, arrow, ms=ms, mec=colour, mfc=fill)
    if abs(estimate) <= _WIDEST:
        axes.plot(estimate, row, "o", ms=5.5, mec=colour, mfc=fill)


def metrics_panels(comparison: Comparison) -> list[Panel]:
    """Return each metric's mean with its interval, a tick an episode."""
    metrics = dict.fromkeys(each.measure for each in comparison.everything.differences)
    values = comparison.everything.measurements.values
    return [_metric(comparison, m) for m in metrics if any(v.known.size for v in values[m.name].values())]


def _metric(comparison: Comparison, metric: Measure) -> Panel:
    view, ranked = comparison.everything, not comparison.unlike
    apart = {each.label for each in view.differences if each.measure is metric and each.incomparable}
    axes = new_figure(2.7, 0.42 + 0.3 * len(view.groups)).subplots()
    found = [
        replace(each, estimate=None) if each.label in apart else each
        for each in view.measurements.values[metric.name].values()
    ]
    draw_values(axes, found, [{"color": comparison.colours[each.label]} for each in found])
    rows(axes, comparison.labels, _SMALL_LABEL)
    axes.locator_params(axis="x", nbins=4)
    if turned(metric, ranked):
        axes.invert_xaxis()
    title = _called(metric, ranked)
    return Panel(f"{title} [{metric.unit}]" if metric.unit else title, axes.figure)


def trajectory_panels(comparison: Comparison) -> list[Panel]:
    """Return paths from above of each group, the same axes alike; none where no motion is recorded."""
    groups = comparison.everything.groups
    drawn = (_paths(group, comparison.colours[group.label]) for group in groups)
    paths = [panel for panel in drawn if panel.figure.axes[0].lines]
    alike: dict[tuple[str, str], list[Any]] = {}
    for axes in (panel.figure.axes[0] for panel in paths):
        alike.setdefault((axes.get_xlabel(), axes.get_ylabel()), []).append(axes)
    for members in alike.values():
        limits = np.array([[axes.get_xlim(), axes.get_ylim()] for axes in members])
        low, high = limits[..., 0].min(axis=0), limits[..., 1].max(axis=0)
        for axes in members:
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    return paths


def _paths(group: Group, colour: str) -> Panel:
    axes = new_figure(_WIDTH, 2.6).subplots()
    for episode in each_opened(group.episodes[:_SHOWN]):
        line = _FAILED if episode.success is False else colour
        for hand, style in zip(episode.hands or ("",), cycle(_STYLES.values())):
            with suppress(DoesNotApply):
                motion = (episode.of_hand(hand) if hand else episode).motion
                x, y = motion[:, 0], motion[:, 1] if motion.shape[1] > 1 else np.zeros(len(motion))
                axes.plot(x, y, color=line, lw=1.0, alpha=0.7, ls=style)
                axes.plot(x[-1], y[-1], "o", color=line, ms=3)
    (first,) = each_opened(group.episodes[:1])
    names = ("tool x [m]", "tool y [m]") if first.motion_is_tool else _first_names(first)
    axes.set(xlabel=short(names[0], _AXIS_LABEL), ylabel=short(names[1], _AXIS_LABEL))
    if first.motion_is_tool:
        axes.set_aspect("equal", adjustable="box")
    tidy(axes)
    failed = ", grey: failed" if any(e.success is False for e in group.episodes) else ""
    hands = "".join(f", {style}: {hand}" for hand, style in zip(first.hands, cycle(_STYLES)))
    return Panel(f"{group.label}: paths", axes.figure, f"dot: end{failed}{hands}")


def _first_names(episode: Demonstration) -> tuple[str, str]:
    entries = episode.entries("state")
    moving = [entries[place] for place in position_entries(entries)] or entries
    names = [*moving, "first of the state", "second of the state"]
    return names[0], names[1]

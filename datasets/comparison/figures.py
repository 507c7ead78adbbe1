"""The figures of the page: the answer, how metrics differ and every episode, where the motion went.

What is better is always right.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from handrail.datasets.comparison.collection import Collected
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.episodes import MetricContrast
from handrail.datasets.comparison.groups import Group, group_of
from handrail.datasets.comparison.policies import ConditionOutcome
from handrail.datasets.presentation.drawing import COLOURS, GREY, INK, Panel, new_figure, rows, short, tidy
from handrail.datasets.quality.measure import Measured
from handrail.datasets.quality.metric import Metric
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply
from handrail.datasets.reading.load import each_opened
from handrail.datasets.reading.naming import position_entries

_WIDTH = 5.2  # [inch]
_LABEL, _SMALL_LABEL, _AXIS_LABEL = 26, 14, 30  # characters beside axes
TURNED = "↓"  # marks a metric of which less is better, drawn the other way round
_WIDEST = 4.0  # standard deviations that are shown
_SHOWN = 50  # paths a group
_FAILED = "#b8bec6"

Colours = Mapping[str, str]


def colours(comparison: Comparison) -> dict[str, str]:
    """Return a colour for each group, and each condition of policies that belongs to it."""
    found: dict[str, str] = dict(zip(comparison.labels, COLOURS, strict=False))
    for condition in comparison.outcomes.conditions if comparison.outcomes else ():
        found.setdefault(condition.label, found[group_of(condition.label, comparison.labels)])
    return found


def answer_panels(comparison: Comparison) -> list[Panel]:
    """Return success of the policies, or else in collection, and how it came about."""
    known, everything = colours(comparison), comparison.everything
    conditions = comparison.outcomes.conditions if comparison.outcomes else ()
    height = max(2.4, 1.0 + 0.4 * max(len(conditions), len(everything.collected)))
    first = (
        _conditions(conditions, known, height) if conditions else _shares(everything.collected, known, height)
    )
    return [first, _over_time(everything.groups, known, height)]


def _conditions(conditions: Sequence[ConditionOutcome], known: Colours, height: float) -> Panel:
    axes = new_figure(_WIDTH, height).subplots()
    for row, condition in enumerate(conditions):
        colour = known[condition.label]
        style = {"color": colour, "lw": 5.0, "alpha": 0.35, "solid_capstyle": "butt"}
        axes.plot(np.multiply(100, condition.wilson), [row, row], **style)
        if condition.nested:
            axes.plot(np.multiply(100, condition.nested), [row, row], color=colour, lw=1.6)
        ticks = np.full(len(condition.seeds), row + 0.24)
        axes.plot(np.multiply(100, condition.seeds), ticks, "|", color=colour, ms=6)
        axes.plot(100 * condition.share, row, "o", color=colour, ms=8, mec="white")
    axes.set(xlabel="%", xlim=(-2, 102))
    rows(axes, [condition.label for condition in conditions], _LABEL)
    note = "95 %; thick: these policies, thin: with training too, ticks: each training seed"
    return Panel("Success of the policies", axes.figure, note)


def _shares(collected: Sequence[Collected], known: Colours, height: float) -> Panel:
    axes = new_figure(_WIDTH, height).subplots()
    for row, each in enumerate(collected):
        if each.success is None or each.success_interval is None:
            axes.text(50, row, "not recorded", ha="center", va="center", color=GREY, size=8.5)
            continue
        axes.plot(np.multiply(100, each.success_interval), [row, row], color=known[each.label], lw=2.2)
        axes.plot(100 * each.success, row, "o", color=known[each.label], ms=8, mec="white")
    axes.set(xlabel="%", xlim=(-2, 102))
    rows(axes, [each.label for each in collected], _LABEL)
    return Panel("Success while collecting", axes.figure, "95 % (Wilson)")


def _over_time(groups: Sequence[Group], known: Colours, height: float) -> Panel:
    axes = new_figure(_WIDTH, height).subplots()
    unknown = any(episode.success is None for group in groups for episode in group.episodes)
    for group in groups:
        minutes = np.cumsum([0.0, *(episode.seconds for episode in group.episodes)]) / 60.0
        counts = np.cumsum([0, *(unknown or bool(episode.success) for episode in group.episodes)])
        axes.step(minutes, counts, where="post", color=known[group.label], lw=1.8)
        axes.plot(minutes[-1], counts[-1], "o", color=known[group.label], ms=5)
    what = "episodes" if unknown else "successes"
    axes.set(xlabel="min", ylabel=what, xlim=(0, None), ylim=(0, None))
    tidy(axes)
    return Panel(f"{what.capitalize()} over the operator's time", axes.figure)


def turned(metric: Metric, ranked: bool) -> bool:
    """Return whether a metric is drawn the other way round, so that right is better."""
    return ranked and metric.good == "lower"


def _called(metric: Metric, ranked: bool) -> str:
    return f"{metric.title} {TURNED}" if turned(metric, ranked) else metric.title


def effects_panels(comparison: Comparison) -> list[Panel]:
    """Return every metric's difference in standard deviations: those that can be better, then the others."""
    found = [each for each in comparison.everything.differences if each.tested]
    ranked, base = not comparison.unlike, comparison.baseline
    judged = [each for each in found if each.measure.good and ranked]
    rest = [each for each in found if each not in judged]
    drawn = (
        (f"Right is better than {base}, left is worse", judged),
        (f"Right is more than {base}, left is less: neither counts as good", rest),
    )
    known = colours(comparison)
    return [Panel(title, _effects(each, known, ranked, comparison)) for title, each in drawn if each]


def _effects(found: Sequence[MetricContrast], known: Colours, ranked: bool, comparison: Comparison) -> Any:
    metrics = list({each.measure.name: each.measure for each in found}.values())
    places, labels = [metric.name for metric in metrics], list(comparison.success)
    axes = new_figure(8.4, 0.6 + 0.28 * len(places)).subplots()
    axes.axvline(0.0, color=GREY, lw=1.0)
    for each in found:
        shift = 0.5 * ((labels.index(each.label) + 0.5) / len(labels) - 0.5)
        row = places.index(each.measure.name) + shift
        draw_effect(axes, each, row, known[each.label], -1.0 if turned(each.measure, ranked) else 1.0)
    axes.set(xlim=(-_WIDEST - 0.15, _WIDEST + 0.15), xlabel="difference in standard deviations, 95 %")
    rows(axes, [_called(metric, ranked) for metric in metrics])
    return axes.figure


def draw_effect(axes: Any, each: MetricContrast, row: float, colour: str, sign: float) -> None:
    """Draw a difference with its interval; what lies outside, or is infinite, is an arrow at the edge."""
    estimate, *ends = (sign * value for value in each.effect)
    low, high = sorted(ends)
    alpha = 1.0 if each.detected else 0.45
    axes.plot(np.clip([low, high], -_WIDEST, _WIDEST), [row, row], color=colour, lw=1.6, alpha=alpha)
    fill = colour if each.detected else "white"
    for value, ms in ((low, 5.0), (high, 5.0), (estimate, 7.5)):
        if abs(value) > _WIDEST:
            arrow = ">" if value > 0 else "<"
            axes.plot(np.copysign(_WIDEST, value), row, arrow, ms=ms, mec=colour, mfc=fill)
    if abs(estimate) <= _WIDEST:
        axes.plot(estimate, row, "o", ms=5.5, mec=colour, mfc=fill)


def metrics_panels(comparison: Comparison) -> list[Panel]:
    """Return each metric's values, one dot an episode, with mean and interval."""
    view, ranked = comparison.everything, not comparison.unlike
    metrics = {each.measure.name: each.measure for each in view.differences}.values()
    shown = [m for m in metrics if any(v.known.size for v in view.measurements.values[m.name].values())]
    return [_metric(comparison, metric, ranked) for metric in shown]


def _metric(comparison: Comparison, metric: Metric, ranked: bool) -> Panel:
    known, view = colours(comparison), comparison.everything
    apart = {each.label for each in view.differences if each.measure is metric and each.incomparable}
    axes = new_figure(2.7, 0.42 + 0.3 * len(view.groups)).subplots()
    rng = np.random.default_rng(0)
    for row, (label, found) in enumerate(view.measurements.values[metric.name].items()):
        if not found.known.size or label in apart:
            _say(axes, row, "not comparable" if found.known.size else "does not apply")
        else:
            _strip(axes, found, row, known[label], rng)
    rows(axes, comparison.labels, _SMALL_LABEL)
    axes.locator_params(axis="x", nbins=4)
    if turned(metric, ranked):
        axes.invert_xaxis()
    title = _called(metric, ranked)
    return Panel(f"{title} [{metric.unit}]" if metric.unit else title, axes.figure)


def _say(axes: Any, row: int, text: str) -> None:
    across = axes.get_yaxis_transform()
    axes.text(0.5, row, text, transform=across, ha="center", va="center", color=GREY, size=7.5)


def _strip(axes: Any, found: Measured, row: int, colour: str, rng: np.random.Generator) -> None:
    heights = row + rng.uniform(-0.24, 0.24, len(found.known))
    axes.plot(found.known, heights, "o", color=colour, ms=2.6, alpha=0.45, mew=0)
    if found.interval:
        axes.plot(found.interval, [row, row], color=INK, lw=1.8)
    axes.plot(found.mean, row, "D", color=colour, ms=5, mec=INK, mew=0.8)


def trajectory_panels(comparison: Comparison) -> list[Panel]:
    """Return paths from above of each group; none where no motion is recorded."""
    groups = [group for group in comparison.everything.groups if _has_motion(group)]
    known = colours(comparison)
    paths = [_paths(group, known[group.label]) for group in groups]
    _same_limits(panel.figure.axes[0] for panel in paths)
    return paths


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


def _has_motion(group: Group) -> bool:
    try:
        return any(episode.motion.shape[1] > 0 for episode in each_opened(group.episodes[:1]))
    except DoesNotApply:
        return False


def _paths(group: Group, colour: str) -> Panel:
    axes = new_figure(_WIDTH, 2.6).subplots()
    for episode in each_opened(group.episodes[:_SHOWN]):
        motion = episode.motion
        x, y = motion[:, 0], motion[:, 1] if motion.shape[1] > 1 else np.zeros(len(motion))
        line = _FAILED if episode.success is False else colour
        axes.plot(x, y, color=line, lw=1.0, alpha=0.7)
        axes.plot(x[-1], y[-1], "o", color=line, ms=3)
    (first,) = each_opened(group.episodes[:1])
    names = ("tool x [m]", "tool y [m]") if first.motion_is_tool else _first_names(first)
    axes.set(xlabel=short(names[0], _AXIS_LABEL), ylabel=short(names[1], _AXIS_LABEL))
    if first.motion_is_tool:
        axes.set_aspect("equal", adjustable="box")
    tidy(axes)
    failed = ", grey: failed" if any(e.success is False for e in group.episodes) else ""
    return Panel(f"{group.label}: paths", axes.figure, f"dot: end{failed}")


def _first_names(episode: Demonstration) -> tuple[str, str]:
    entries = episode.entries("state")
    moving = [entries[place] for place in position_entries(entries)] or entries
    names = [*moving, "first of the state", "second of the state"]
    return names[0], names[1]

"""The figures of the metrics: how they differ, and every episode; what is better is always right."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.differences import Difference
from handrail.datasets.comparison.means import Mean
from handrail.datasets.comparison.report.figures import Colours, colours
from handrail.datasets.presentation.drawing import GREY, INK, Panel, new_figure, short, tidy
from handrail.datasets.quality.metric import Metric

TURNED = "↓"  # marks a metric of which less is better, drawn the other way round
_WIDEST = 4.0  # standard deviations that are shown
_LABEL = 14  # characters beside small axes


def turned(metric: Metric, ranked: bool) -> bool:
    """Return whether a metric is drawn the other way round, so that right is better."""
    return ranked and metric.good == "lower"


def _called(metric: Metric, ranked: bool) -> str:
    return f"{metric.title} {TURNED}" if turned(metric, ranked) else metric.title


def effects_panels(comparison: Comparison) -> list[Panel]:
    """Return every metric's difference in standard deviations: those that can be better, then the others."""
    found = [each for each in comparison.everything.differences if each.tested and not each.reason]
    ranked, base = not comparison.unlike, comparison.baseline
    judged = [each for each in found if each.metric.good and ranked]
    rest = [each for each in found if each not in judged]
    drawn = (
        (f"Right is better than {base}, left is worse", judged),
        (f"Right is more than {base}, left is less: neither counts as good", rest),
    )
    known = colours(comparison)
    return [Panel(title, _effects(each, known, ranked, comparison)) for title, each in drawn if each]


def _effects(found: Sequence[Difference], known: Colours, ranked: bool, comparison: Comparison) -> Any:
    metrics = list({each.metric.name: each.metric for each in found}.values())
    rows, labels = [metric.name for metric in metrics], list(comparison.success)
    figure = new_figure(8.4, 0.6 + 0.28 * len(rows))
    axes = figure.subplots()
    axes.axvline(0.0, color=GREY, lw=1.0)
    for each in found:
        shift = 0.5 * ((labels.index(each.label) + 0.5) / len(labels) - 0.5)
        row = rows.index(each.metric.name) + shift
        draw_effect(axes, each, row, known[each.label], -1.0 if turned(each.metric, ranked) else 1.0)
    names = [_called(metric, ranked) for metric in metrics]
    axes.set(ylim=(len(rows) - 0.4, -0.6), yticks=range(len(rows)), yticklabels=names)
    axes.set(xlim=(-_WIDEST - 0.15, _WIDEST + 0.15), xlabel="difference in standard deviations, 95 %")
    tidy(axes, "x")
    return figure


def draw_effect(axes: Any, each: Difference, row: float, colour: str, sign: float) -> None:
    """Draw a difference with its interval; what lies outside, or is infinite, is an arrow at the edge."""
    estimate, *ends = (sign * value for value in each.effect)
    low, high = sorted(ends)
    axes.plot(
        np.clip([low, high], -_WIDEST, _WIDEST),
        [row, row],
        color=colour,
        lw=1.6,
        alpha=1.0 if each.detected else 0.45,
    )
    fill = colour if each.detected else "white"
    for value, ms in ((low, 5.0), (high, 5.0), (estimate, 7.5)):
        if abs(value) > _WIDEST:
            axes.plot(
                np.copysign(_WIDEST, value), row, ">" if value > 0 else "<", ms=ms, mec=colour, mfc=fill
            )
    if abs(estimate) <= _WIDEST:
        axes.plot(estimate, row, "o", ms=5.5, mec=colour, mfc=fill)


def metrics_panels(comparison: Comparison) -> list[Panel]:
    """Return each metric's values, one dot an episode, with mean and interval."""
    view, ranked = comparison.everything, not comparison.unlike
    metrics = {each.metric.name: each.metric for each in view.differences}.values()
    shown = [m for m in metrics if any(v.applies for v in view.measurements.values[m.name].values())]
    return [_metric(comparison, metric, ranked) for metric in shown]


def _metric(comparison: Comparison, metric: Metric, ranked: bool) -> Panel:
    known, view = colours(comparison), comparison.everything
    apart = {each.label for each in view.differences if each.metric is metric and each.incomparable}
    figure, rng = new_figure(2.7, 0.42 + 0.3 * len(view.groups)), np.random.default_rng(0)
    axes = figure.subplots()
    for row, (label, found) in enumerate(view.measurements.values[metric.name].items()):
        mean = view.means[metric.name][label]
        if mean.mean is None or label in apart:
            _say(axes, row, "does not apply" if mean.mean is None else "not comparable")
        else:
            _strip(axes, found.values[np.isfinite(found.values)], mean, row, known[label], rng)
    names = [short(label, _LABEL) for label in comparison.labels]
    axes.set(ylim=(len(names) - 0.4, -0.6), yticks=range(len(names)), yticklabels=names)
    axes.locator_params(axis="x", nbins=4)
    if turned(metric, ranked):
        axes.invert_xaxis()
    tidy(axes, "x")
    title = _called(metric, ranked)
    return Panel(f"{title} [{metric.unit}]" if metric.unit else title, figure)


def _say(axes: Any, row: int, text: str) -> None:
    across = axes.get_yaxis_transform()
    axes.text(0.5, row, text, transform=across, ha="center", va="center", color=GREY, size=7.5)


def _strip(
    axes: Any, values: FloatArray, mean: Mean, row: int, colour: str, rng: np.random.Generator
) -> None:
    heights = row + rng.uniform(-0.24, 0.24, len(values))
    axes.plot(values, heights, "o", color=colour, ms=2.6, alpha=0.45, mew=0)
    if mean.interval:
        axes.plot(mean.interval, [row, row], color=INK, lw=1.8)
    axes.plot(mean.mean, row, "D", color=colour, ms=5, mec=INK, mew=0.8)

"""The figures of the answer: success, successes over the operator's time, and which metrics differ."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.comparison.collection import Collected
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.differences import Difference
from handrail.datasets.comparison.drawing import COLOURS, GREY, INK, new_figure, svg, tidy
from handrail.datasets.comparison.groups import Group, group_of
from handrail.datasets.comparison.means import Mean
from handrail.datasets.comparison.outcomes import ArmOutcome

_WIDEST = 4.0  # standard deviations that are shown


def colours(comparison: Comparison) -> dict[str, str]:
    """Return a colour for each group, and each arm of policies that belongs to it."""
    found: dict[str, str] = dict(zip(comparison.labels, COLOURS, strict=False))
    for arm in comparison.outcomes.arms if comparison.outcomes else ():
        found.setdefault(arm.label, found[group_of(arm.label, comparison.labels)])
    return found


def answer_figure(comparison: Comparison) -> str:
    """Return the first figure: success of the policies, or else in collection, and how it came about."""
    known = colours(comparison)
    collected = comparison.everything.collected
    arms = comparison.outcomes.arms if comparison.outcomes else ()
    rows = max(len(arms), len(collected))
    figure = new_figure(10.4, max(2.5, 1.35 + 0.42 * rows))
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.0))
    if arms:
        _arms(left, arms, known)
    else:
        _shares(left, collected, known)
    _over_time(right, comparison.everything.groups, known)
    return svg(figure)


def _arms(axes: Any, arms: Sequence[ArmOutcome], known: dict[str, str]) -> None:
    for row, arm in enumerate(arms):
        colour = known[arm.label]
        axes.plot(
            np.multiply(100, arm.wilson), [row, row], color=colour, lw=5.0, alpha=0.35, solid_capstyle="butt"
        )
        if arm.nested:
            axes.plot(np.multiply(100, arm.nested), [row, row], color=colour, lw=1.6)
        axes.plot(np.multiply(100, arm.seeds), np.full(len(arm.seeds), row + 0.24), "|", color=colour, ms=6)
        axes.plot(100 * arm.share, row, "o", color=colour, ms=8, mec="white")
    axes.set(
        title="policy success, 95 %: thick these policies, thin training too; ticks: each seed", xlabel="%"
    )
    _labelled(axes, [arm.label for arm in arms])


def _shares(axes: Any, collected: Sequence[Collected], known: dict[str, str]) -> None:
    for row, each in enumerate(collected):
        if each.success is None or each.success_interval is None:
            axes.text(50, row, "not recorded", ha="center", va="center", color=GREY, size=8.5)
            continue
        axes.plot(np.multiply(100, each.success_interval), [row, row], color=known[each.label], lw=2.2)
        axes.plot(100 * each.success, row, "o", color=known[each.label], ms=8, mec="white")
    axes.set(title="success while collecting, 95 % (Wilson)", xlabel="%")
    _labelled(axes, [each.label for each in collected])


def _labelled(axes: Any, labels: Sequence[str]) -> None:
    axes.set(xlim=(-2, 102), ylim=(len(labels) - 0.4, -0.6), yticks=range(len(labels)), yticklabels=labels)
    tidy(axes, "x")


def _over_time(axes: Any, groups: Sequence[Group], known: dict[str, str]) -> None:
    unknown = any(episode.success is None for group in groups for episode in group.episodes)
    for group in groups:
        minutes = np.cumsum([0.0, *(episode.seconds for episode in group.episodes)]) / 60.0
        counts = np.cumsum([0, *(unknown or bool(episode.success) for episode in group.episodes)])
        axes.step(minutes, counts, where="post", color=known[group.label], lw=1.8, label=group.label)
        axes.plot(minutes[-1], counts[-1], "o", color=known[group.label], ms=5)
    what = "episodes" if unknown else "successes"
    axes.set(title=f"{what} over the operator's time", xlabel="min", ylabel=what)
    axes.set(xlim=(0, None), ylim=(0, None))
    axes.legend(fontsize=8, frameon=False, loc="lower right")
    tidy(axes)


def effects_figure(comparison: Comparison) -> str:
    """Return every metric's difference in standard deviations, with its interval."""
    known = colours(comparison)
    found = [each for each in comparison.everything.differences if each.tested and not each.reason]
    titles = list(dict.fromkeys(each.metric.title for each in found))
    figure = new_figure(10.4, max(1.6, 1.0 + 0.27 * len(titles)))
    axes = figure.subplots()
    axes.axvline(0.0, color=GREY, lw=1.0)
    labels = list(comparison.success)
    for each in found:
        shift = 0.5 * ((labels.index(each.label) + 0.5) / len(labels) - 0.5)
        _effect(axes, each, titles.index(each.metric.title) + shift, known[each.label])
    axes.set(ylim=(len(titles) - 0.4, -0.6), yticks=range(len(titles)), yticklabels=titles)
    axes.set_xlabel(f"difference to {comparison.baseline} in standard deviations, 95 %")
    axes.set_xlim(-_WIDEST, _WIDEST)
    for label in labels:
        axes.plot([], [], "o-", color=known[label], ms=5, label=label)
    axes.plot([], [], "o", mfc="white", mec=INK, ms=5, label="not detected")
    axes.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    tidy(axes, "x")
    return svg(figure)


def _effect(axes: Any, each: Difference, row: float, colour: str) -> None:
    estimate, low, high = np.clip(each.effect, -_WIDEST, _WIDEST)
    axes.plot([low, high], [row, row], color=colour, lw=1.6, alpha=1.0 if each.detected else 0.45)
    axes.plot(estimate, row, "o", ms=5.5, mec=colour, mfc=colour if each.detected else "white")


def metrics_figure(comparison: Comparison) -> str:
    """Return each metric's values, one dot an episode, with mean and interval."""
    known, view = colours(comparison), comparison.everything
    metrics = list({each.metric.name: each.metric for each in view.differences}.values())
    shown = [m for m in metrics if any(v.applies for v in view.measurements.values[m.name].values())]
    columns = 4
    lines = -(-len(shown) // columns)
    figure = new_figure(10.4, 0.4 + lines * (0.75 + 0.3 * len(view.groups)))
    grid = figure.subplots(lines, columns, squeeze=False).ravel()
    rng = np.random.default_rng(0)
    for axes, metric in zip(grid, shown, strict=False):
        for row, (label, found) in enumerate(view.measurements.values[metric.name].items()):
            values = found.values[np.isfinite(found.values)]
            _strip(axes, values, view.means[metric.name][label], row, known[label], rng)
        axes.set_title(f"{metric.title} [{metric.unit}]" if metric.unit else metric.title)
        axes.set(
            ylim=(len(view.groups) - 0.4, -0.6), yticks=range(len(view.groups)), yticklabels=comparison.labels
        )
        axes.locator_params(axis="x", nbins=4)
        tidy(axes, "x")
    for axes in grid[len(shown) :]:
        axes.set_visible(False)
    return svg(figure)


def _strip(
    axes: Any, values: FloatArray, mean: Mean, row: int, colour: str, rng: np.random.Generator
) -> None:
    if mean.mean is None:
        across = axes.get_yaxis_transform()
        axes.text(
            0.5, row, "does not apply", transform=across, ha="center", va="center", color=GREY, size=7.5
        )
        return
    axes.plot(
        values, row + rng.uniform(-0.24, 0.24, len(values)), "o", color=colour, ms=2.6, alpha=0.45, mew=0
    )
    if mean.interval:
        axes.plot(mean.interval, [row, row], color=INK, lw=1.8)
    axes.plot(mean.mean, row, "D", color=colour, ms=5, mec=INK, mew=0.8)

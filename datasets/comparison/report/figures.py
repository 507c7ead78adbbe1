"""The figures of the answer: success of policies or in collection, and the operator's time."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from handrail.datasets.comparison.collection import Collected
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.groups import Group, group_of
from handrail.datasets.comparison.outcomes import ConditionOutcome
from handrail.datasets.presentation.drawing import COLOURS, GREY, Panel, new_figure, short, tidy

_WIDTH = 5.2  # [inch]
_LABEL = 26  # characters beside axes

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
    figure = new_figure(_WIDTH, height)
    axes = figure.subplots()
    for row, condition in enumerate(conditions):
        colour = known[condition.label]
        style = {"color": colour, "lw": 5.0, "alpha": 0.35, "solid_capstyle": "butt"}
        axes.plot(np.multiply(100, condition.wilson), [row, row], **style)
        if condition.nested:
            axes.plot(np.multiply(100, condition.nested), [row, row], color=colour, lw=1.6)
        axes.plot(
            np.multiply(100, condition.seeds),
            np.full(len(condition.seeds), row + 0.24),
            "|",
            color=colour,
            ms=6,
        )
        axes.plot(100 * condition.share, row, "o", color=colour, ms=8, mec="white")
    axes.set(xlabel="%")
    _labelled(axes, [condition.label for condition in conditions])
    note = "95 %; thick: these policies, thin: with training too, ticks: each training seed"
    return Panel("Success of the policies", figure, note)


def _shares(collected: Sequence[Collected], known: Colours, height: float) -> Panel:
    figure = new_figure(_WIDTH, height)
    axes = figure.subplots()
    for row, each in enumerate(collected):
        if each.success is None or each.success_interval is None:
            axes.text(50, row, "not recorded", ha="center", va="center", color=GREY, size=8.5)
            continue
        axes.plot(np.multiply(100, each.success_interval), [row, row], color=known[each.label], lw=2.2)
        axes.plot(100 * each.success, row, "o", color=known[each.label], ms=8, mec="white")
    axes.set(xlabel="%")
    _labelled(axes, [each.label for each in collected])
    return Panel("Success while collecting", figure, "95 % (Wilson)")


def _labelled(axes: Any, labels: Sequence[str]) -> None:
    names = [short(label, _LABEL) for label in labels]
    axes.set(xlim=(-2, 102), ylim=(len(labels) - 0.4, -0.6), yticks=range(len(labels)), yticklabels=names)
    tidy(axes, "x")


def _over_time(groups: Sequence[Group], known: Colours, height: float) -> Panel:
    figure = new_figure(_WIDTH, height)
    axes = figure.subplots()
    unknown = any(episode.success is None for group in groups for episode in group.episodes)
    for group in groups:
        minutes = np.cumsum([0.0, *(episode.seconds for episode in group.episodes)]) / 60.0
        counts = np.cumsum([0, *(unknown or bool(episode.success) for episode in group.episodes)])
        axes.step(minutes, counts, where="post", color=known[group.label], lw=1.8)
        axes.plot(minutes[-1], counts[-1], "o", color=known[group.label], ms=5)
    what = "episodes" if unknown else "successes"
    axes.set(xlabel="min", ylabel=what, xlim=(0, None), ylim=(0, None))
    tidy(axes)
    return Panel(f"{what.capitalize()} over the operator's time", figure)

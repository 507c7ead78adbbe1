"""The figures of a study: the answer by task, what disturbs, and how it depends on the operator's noise."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from handrail.datasets.comparison.outcomes import ConditionOutcome
from handrail.datasets.presentation.drawing import COLOURS, new_figure, tidy
from handrail.policies.study.design.design import StudyDesign
from handrail.policies.study.report.conditions import StudyCondition
from handrail.policies.study.report.results import TaskResults

_WIDTH = 10.4  # [inch]


def figures(design: StudyDesign, results: Sequence[TaskResults]) -> dict[str, Any]:
    """Return matplotlib figures by name; those for which there is something to show."""
    made: dict[str, Any] = {}
    evaluated = [each for each in results if each.undisturbed]
    if evaluated:
        made["answer"] = _answer(design, evaluated)
    if any(each.disturbed for each in evaluated):
        made["robustness"] = _robustness(design, [each for each in evaluated if each.disturbed])
    swept = [each for each in evaluated if each.sweep]
    if swept:
        made["sweep"] = _sweep(design, swept)
    return made


def _style(design: StudyDesign, condition: StudyCondition) -> dict[str, Any]:
    """Return how a condition is drawn: the mode's colour, the action's mark."""
    colour = COLOURS[design.modes.index(condition.mode) % len(COLOURS)]
    mark = "D" if condition.actions == "intent" else "o"
    return {"color": colour, "marker": mark, "ms": 5, "label": _name(condition)}


def _name(condition: StudyCondition) -> str:
    """Return what a condition is called: an intent is no policy alone."""
    data = f"{condition.mode}, same number" if condition.budget == "number" else condition.mode
    return f"{data}:\nintent through MPC" if condition.actions == "intent" else data


def _answer(design: StudyDesign, results: Sequence[TaskResults]) -> Any:
    """One panel a task: success of every condition; thick: these policies, thin: training, ticks: seeds."""
    rows = max(len(each.undisturbed) for each in results)
    figure = new_figure(_WIDTH, 1.2 + 0.4 * rows)
    grid = figure.subplots(1, len(results), squeeze=False)[0]
    for axes, each in zip(grid, results, strict=True):
        for row, found in enumerate(each.undisturbed.values()):
            outcome, style = found.outcome, _style(design, found.condition) | {"ms": 8, "mec": "white"}
            colour = style["color"]
            axes.plot(np.multiply(100, outcome.wilson), [row, row], color=colour, lw=5.0, alpha=0.35)
            if outcome.nested:
                axes.plot(np.multiply(100, outcome.nested), [row, row], color=colour, lw=1.4)
            axes.plot(
                np.multiply(100, outcome.seeds),
                np.full(len(outcome.seeds), row + 0.26),
                "|",
                color=colour,
                ms=6,
            )
            axes.plot(100 * outcome.share, row, **style)
        labels = [_name(found.condition) for found in each.undisturbed.values()]
        axes.set(title=each.task.replace("_", " "), xlabel="policy success [%]", xlim=(-3, 103))
        axes.set(ylim=(len(labels) - 0.4, -0.6), yticks=range(len(labels)), yticklabels=labels)
        tidy(axes, "x")
    return figure


def _robustness(design: StudyDesign, results: Sequence[TaskResults]) -> Any:
    """One panel a task: success of every condition under every treatment."""
    figure = new_figure(_WIDTH, 3.2)
    grid = figure.subplots(1, len(results), squeeze=False, sharey=True)[0]
    for axes, each in zip(grid, results, strict=True):
        names = [
            "undisturbed",
            *dict.fromkeys(found.condition.treatment for found in each.disturbed.values()),
        ]
        conditions = list(
            dict.fromkeys(replace(found.condition, treatment="") for found in each.disturbed.values())
        )
        for place, condition in enumerate(conditions):
            shown = by_treatment(each, condition)
            xs = [names.index(name) for name in shown]
            shift = 0.5 * ((place + 0.5) / len(conditions) - 0.5)
            values = np.array([outcome.share for outcome in shown.values()])
            spans = np.array([outcome.wilson for outcome in shown.values()])
            errors = np.abs(spans.T - values) * 100
            style = _style(design, condition) | {"ls": "", "elinewidth": 1.2}
            axes.errorbar(np.array(xs) + shift, 100 * values, yerr=errors, **style)
        axes.set(title=each.task.replace("_", " "), xticks=range(len(names)), ylim=(-3, 103))
        axes.set_xticklabels(names, rotation=20)
        tidy(axes, "y")
    grid[0].set_ylabel("policy success [%], 95 %")
    known = dict(pair[::-1] for axes in grid for pair in zip(*axes.get_legend_handles_labels(), strict=True))
    place = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    grid[-1].legend(known.values(), known.keys(), fontsize=8, frameon=False, **place)
    return figure


def by_treatment(results: TaskResults, condition: StudyCondition) -> dict[str, ConditionOutcome]:
    """Return a condition disturbed, and undisturbed: the same policies in the same scenes."""
    mine = [
        found for found in results.disturbed.values() if replace(found.condition, treatment="") == condition
    ]
    without = next((found.without for found in mine if found.without), None)
    shown = {"undisturbed": without} if without else {}
    return shown | {found.condition.treatment: found.outcome for found in mine}


def _sweep(design: StudyDesign, results: Sequence[TaskResults]) -> Any:
    """Success of the policies, and the operator's time for a demonstration, over the operator's noise."""
    figure = new_figure(_WIDTH, 3.0 * len(results))
    grid = figure.subplots(len(results), 2, squeeze=False)
    for (left, right), each in zip(grid, results, strict=True):
        for found in each.sweep.values():
            condition = found[0].condition
            noises = [point.noise for point in found]
            shares = np.array([point.outcome.share for point in found])
            spans = np.array([point.outcome.wilson for point in found])
            style = _style(design, condition) | {"lw": 1.4}
            left.errorbar(noises, 100 * shares, yerr=100 * np.abs(spans.T - shares), **style)
            if condition.actions == "realised":
                right.plot(noises, [point.seconds for point in found], **style)
        left.set(title=each.task.replace("_", " "), ylabel="policy success [%], 95 %", ylim=(-3, 103))
        right.set(title="operator's time", ylabel="s a successful demonstration", ylim=(0, None))
        for axes in (left, right):
            axes.set(xlabel="operator's noise: 0 perfect, 1 as people are")
            tidy(axes)
        right.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure

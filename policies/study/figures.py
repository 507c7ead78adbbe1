"""The figures of a study: the answer by task, what disturbs, and how it depends on the operator's noise."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from handrail.datasets.comparison.drawing import COLOURS, new_figure, tidy
from handrail.policies.study.design import StudyDesign
from handrail.policies.study.results import Condition, TaskResults

_WIDTH = 10.4  # [inch]


def figures(design: StudyDesign, results: Sequence[TaskResults]) -> dict[str, Any]:
    """Return matplotlib figures by name; those for which there is something to show."""
    made: dict[str, Any] = {}
    evaluated = [each for each in results if each.conditions]
    if evaluated:
        made["answer"] = _answer(design, evaluated)
    if any(each.disturbed for each in evaluated):
        made["robustness"] = _robustness(design, [each for each in evaluated if each.disturbed])
    swept = [each for each in evaluated if each.sweep]
    if swept:
        made["sweep"] = _sweep(design, swept)
    return made


def _colour(design: StudyDesign, label: str) -> str:
    mode = max((mode for mode in design.modes if f"{label} ".startswith(f"{mode} ")), key=len)
    return COLOURS[design.modes.index(mode) % len(COLOURS)]


def _mark(label: str) -> str:
    return "D" if " intent" in label else "o"


def _answer(design: StudyDesign, results: Sequence[TaskResults]) -> Any:
    """One panel a task: success of every arm; thick: over rollouts, thin: over training too; ticks: seeds."""
    rows = max(len(each.conditions) for each in results)
    figure = new_figure(_WIDTH, 1.2 + 0.4 * rows)
    grid = figure.subplots(1, len(results), squeeze=False)[0]
    for axes, each in zip(grid, results, strict=True):
        for row, (label, condition) in enumerate(each.conditions.items()):
            arm, colour = condition.outcome, _colour(design, label)
            axes.plot(np.multiply(100, arm.wilson), [row, row], color=colour, lw=5.0, alpha=0.35)
            if arm.nested:
                axes.plot(np.multiply(100, arm.nested), [row, row], color=colour, lw=1.4)
            axes.plot(
                np.multiply(100, arm.seeds), np.full(len(arm.seeds), row + 0.26), "|", color=colour, ms=6
            )
            axes.plot(100 * arm.share, row, _mark(label), color=colour, ms=8, mec="white")
        labels = list(each.conditions)
        axes.set(title=each.task.replace("_", " "), xlabel="policy success [%]", xlim=(-3, 103))
        axes.set(ylim=(len(labels) - 0.4, -0.6), yticks=range(len(labels)), yticklabels=labels)
        tidy(axes, "x")
    return figure


def _robustness(design: StudyDesign, results: Sequence[TaskResults]) -> Any:
    """One panel a task: success of every arm under every condition."""
    figure = new_figure(_WIDTH, 3.2)
    grid = figure.subplots(1, len(results), squeeze=False, sharey=True)[0]
    for axes, each in zip(grid, results, strict=True):
        names = ["undisturbed", *dict.fromkeys(_condition(each, label) for label in each.disturbed)]
        for place, arm in enumerate(each.conditions):
            shown = _by_condition(each, arm)
            xs = [names.index(name) for name in shown]
            shift = 0.5 * ((place + 0.5) / len(each.conditions) - 0.5)
            values = np.array([condition.outcome.share for condition in shown.values()])
            spans = np.array([condition.outcome.wilson for condition in shown.values()])
            errors = np.abs(spans.T - values) * 100
            style = {"color": _colour(design, arm), "fmt": _mark(arm), "ms": 5, "lw": 1.2, "label": arm}
            axes.errorbar(np.array(xs) + shift, 100 * values, yerr=errors, **style)
        axes.set(title=each.task.replace("_", " "), xticks=range(len(names)), ylim=(-3, 103))
        axes.set_xticklabels(names, rotation=20)
        tidy(axes, "y")
    grid[0].set_ylabel("policy success [%], 95 %")
    grid[-1].legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _condition(results: TaskResults, label: str) -> str:
    """Return what disturbs, of a label such as `ee intent push`."""
    arms = [arm for arm in results.conditions if label.startswith(f"{arm} ")]
    return label.removeprefix(max(arms, key=len, default="")).strip()


def _by_condition(results: TaskResults, arm: str) -> Mapping[str, Condition]:
    found = {"undisturbed": results.conditions[arm]}
    for label, condition in results.disturbed.items():
        if label == f"{arm} {_condition(results, label)}":
            found[_condition(results, label)] = condition
    return found


def _sweep(design: StudyDesign, results: Sequence[TaskResults]) -> Any:
    """Success of the policies, and the operator's time for a demonstration, over the operator's noise."""
    figure = new_figure(_WIDTH, 3.0 * len(results))
    grid = figure.subplots(len(results), 2, squeeze=False)
    for (left, right), each in zip(grid, results, strict=True):
        for label, found in each.sweep.items():
            noises = [point.noise for point in found]
            shares = np.array([point.outcome.share for point in found])
            spans = np.array([point.outcome.wilson for point in found])
            style = {
                "color": _colour(design, label),
                "marker": _mark(label),
                "ms": 5,
                "lw": 1.4,
                "label": label,
            }
            left.errorbar(noises, 100 * shares, yerr=100 * np.abs(spans.T - shares), **style)
            if " intent" not in label:
                right.plot(noises, [point.seconds for point in found], **style)
        left.set(title=each.task.replace("_", " "), ylabel="policy success [%], 95 %", ylim=(-3, 103))
        right.set(title="operator's time", ylabel="s a successful demonstration", ylim=(0, None))
        for axes in (left, right):
            axes.set(xlabel="operator's noise: 0 perfect, 1 as people are")
            tidy(axes)
        right.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure

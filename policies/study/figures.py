"""The figures of a study: contrasts, the policies by task, their training, what disturbs."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from handrail.datasets.presentation.drawing import COLOURS, GREY, INK, new_figure, tidy
from handrail.datasets.statistics.contrast import Contrast
from handrail.policies.study.contrasts import DECLARED
from handrail.policies.study.results import Results, StudyCondition

_WIDTH = 10.4  # [inch]


def figures(results: Results, found: Sequence[Contrast]) -> dict[str, Any]:
    """Return matplotlib figures by name; those for which there is something to show."""
    tasks = [task for task in results.progress.design.tasks if results.of_task(task)]
    made: dict[str, Any] = {}
    if any(each.interval and each.family == DECLARED for each in found):
        made["contrasts"] = _contrasts(found)
    if tasks:
        made["answer"] = _answer(tasks, results)
    curved = [task for task in tasks if any(_curves(each, results) for each in results.of_task(task))]
    if curved:
        made["training"] = _training(curved, results)
    disturbed = [task for task in tasks if results.of_task(task, treated=True)]
    if disturbed:
        made["robustness"] = _robustness(disturbed, results)
    return made


def _contrasts(found: Sequence[Contrast]) -> Any:
    """The declared contrasts over all tasks, and beneath them the same of each task, which explore."""
    declared = [each for each in found if each.family == DECLARED and each.interval]
    rows: list[tuple[str, Contrast]] = []
    for each in declared:
        rows.append((each.label, each))
        same = (c for c in found if (c.label, c.measure) == (each.label, each.measure) and c is not each)
        rows += [(f"{c.scope} (exploratory)", c) for c in same if c.interval]
    figure = new_figure(_WIDTH, 0.9 + 0.34 * len(rows))
    axes = figure.subplots()
    for row, (_, each) in enumerate(rows):
        first = each.family == DECLARED
        colour = INK if first else GREY
        axes.plot(
            np.multiply(100, each.interval or (0, 0)),
            [row, row],
            color=colour,
            lw=2.4 if first else 1.2,
        )
        axes.plot(np.multiply(100, each.estimate or 0.0), row, "o", color=colour, ms=7 if first else 4)
    axes.axvline(0.0, color=GREY, lw=0.8)
    axes.set(yticks=range(len(rows)), yticklabels=[name for name, _ in rows], ylim=(len(rows) - 0.4, -0.6))
    axes.set_xlabel("difference in policy success [points], 95 %")
    tidy(axes, "x")
    return figure


def _style(condition: StudyCondition, results: Results) -> dict[str, Any]:
    """Return how a condition is drawn: the mode's colour, the action's mark."""
    modes, policy = results.progress.design.modes, condition.learners[0]
    mark = "D" if policy.actions == "intent" else "s" if policy.budget == "number" else "o"
    colour = COLOURS[modes.index(policy.cell.mode) % len(COLOURS)]
    return {"color": colour, "marker": mark, "label": _name(condition)}


def _name(condition: StudyCondition) -> str:
    """Return what a condition is called: an intent is no policy alone."""
    return condition.label.replace(" intent", ":\nintent through MPC").replace(" same", ",\nsame")


def _answer(tasks: Sequence[str], results: Results) -> Any:
    """One panel a task: success of every condition; a line: 95 %, ticks: draws."""
    rows = max(len(results.of_task(task)) for task in tasks)
    figure = new_figure(_WIDTH, 1.2 + 0.4 * rows)
    for axes, task in zip(figure.subplots(1, len(tasks), squeeze=False)[0], tasks, strict=True):
        conditions = results.of_task(task)
        for row, each in enumerate(conditions):
            style = _style(each, results) | {"ms": 7, "mec": "white"}
            axes.plot(np.multiply(100, each.interval), [row, row], color=style["color"], lw=1.6)
            shares = [100 * share for share in each.shares.values()]
            axes.plot(shares, np.full(len(shares), row + 0.26), "|", color=style["color"], ms=6)
            axes.plot(np.multiply(100, each.success.estimate or 0.0), row, **style)
        axes.set(title=task.replace("_", " "), xlabel="policy success [%]", xlim=(-3, 103))
        axes.set(ylim=(len(conditions) - 0.4, -0.6), yticks=range(len(conditions)))
        axes.set_yticklabels([_name(each) for each in conditions])
        tidy(axes, "x")
    return figure


def _curves(condition: StudyCondition, results: Results) -> list[tuple[list[int], list[float]]]:
    """Return updates and loss on held-out episodes of each policy."""
    found = [each["validation"] for each in results.trained(condition) if each.get("validation")]
    return [(steps := sorted(map(int, each)), [each[str(step)] for step in steps]) for each in found]


def _training(tasks: Sequence[str], results: Results) -> Any:
    """One panel a task: the loss on held-out episodes of every policy of joint velocities; a dot ends it."""
    figure = new_figure(_WIDTH, 3.2)
    for axes, task in zip(figure.subplots(1, len(tasks), squeeze=False)[0], tasks, strict=True):
        for each in results.of_task(task):
            if each.label not in results.progress.design.modes:
                continue
            style = _style(each, results)
            for place, (steps, losses) in enumerate(_curves(each, results)):
                name = style["label"] if place == 0 else None
                axes.plot(np.divide(steps, 1000), losses, color=style["color"], lw=0.8, alpha=0.7, label=name)
                axes.plot(steps[-1] / 1000, losses[-1], "o", color=style["color"], ms=3)
        axes.set(title=task.replace("_", " "), xlabel="updates [thousand]", ylim=(0, None), xlim=(0, None))
        axes.legend(fontsize=8, frameon=False)
        tidy(axes)
    figure.axes[0].set_ylabel("loss on held-out episodes")
    return figure


def _robustness(tasks: Sequence[str], results: Results) -> Any:
    """One panel a task: success of every condition under every treatment, and of the same draws without."""
    figure = new_figure(_WIDTH, 3.2)
    grid = figure.subplots(1, len(tasks), squeeze=False, sharey=True)[0]
    for axes, task in zip(grid, tasks, strict=True):
        treated = results.of_task(task, treated=True)
        names = ["undisturbed", *dict.fromkeys(each.treatment for each in treated)]
        labels = list(dict.fromkeys(each.label for each in treated))
        for place, label in enumerate(labels):
            shown = [
                found
                for name in names
                if (found := results.find(task, label, name if name != names[0] else ""))
            ]
            shift = 0.5 * ((place + 0.5) / len(labels) - 0.5)
            xs = [names.index(each.treatment or names[0]) + shift for each in shown]
            values = np.array([each.success.estimate for each in shown])
            errors = np.abs(np.array([each.interval for each in shown]).T - values) * 100
            style = _style(shown[0], results) | {"ls": "", "elinewidth": 1.2, "ms": 5}
            axes.errorbar(xs, 100 * values, yerr=errors, **style)
        axes.set(title=task.replace("_", " "), xticks=range(len(names)), ylim=(-3, 103))
        axes.set_xticklabels(names, rotation=20)
        tidy(axes, "y")
    grid[0].set_ylabel("policy success [%], 95 %")
    known = dict(pair[::-1] for axes in grid for pair in zip(*axes.get_legend_handles_labels(), strict=True))
    place = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    grid[-1].legend(known.values(), known.keys(), fontsize=8, frameon=False, **place)
    return figure

"""The figures of a study: contrasts, the policies by task, what disturbs, growth."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.comparison.figures import draw_values
from handrail.datasets.presentation.drawing import COLOURS, GREY, INK, new_figure, rows, tidy
from handrail.datasets.statistics.contrast import Contrast
from handrail.policies.study.contrasts import DECLARED
from handrail.policies.study.results import Results, StudyCondition
from handrail.policies.study.settings import after

_WIDTH = 10.4  # [inch]
_Stages = Mapping[tuple[str, str], float]  # by ending of a policy's label and treatment: how far grown
CAPTIONS = {
    "contrasts": "Differences: declared, over all tasks (dark), and in each task (grey).",
    "answer": "Success of the policies; lines: 95 %, ticks: draws. Round: joint velocities, unprotected;"
    " diamonds: intent through the MPC, policy and controller;"
    " squares: the same number of demonstrations.",
    "rounds": "Success of the policies, which drive alone, against the operator's time so far; lines: 95 %.",
    "robustness": "Success disturbed and undisturbed.",
    "updates": "Success after more and more updates: the mean over draws, and 95 %.",
    "amounts": "Success against the operator's minutes: the mean over draws, and 95 %.",
}


def figures(results: Results, found: Sequence[Contrast]) -> dict[str, Any]:
    """Return matplotlib figures by name, see `CAPTIONS`; those for which there is something to show."""
    design = results.progress.design
    tasks = [task for task in design.tasks if results.of_task(task)]
    disturbed = [task for task in tasks if _disturbed(task, results)]
    made: dict[str, Any] = {}
    if any(each.interval and each.family == DECLARED for each in found):
        made["contrasts"] = _contrasts(found)
    if rounds := design.rounds:
        return made | ({"rounds": _rounds(tasks, list(rounds.ways), results)} if tasks else {})
    if tasks:
        made["answer"] = _answer(tasks, results)
    if disturbed:
        made["robustness"] = _robustness(disturbed, results)
    if tasks and design.curve:
        less = {("", after(each)): each / 1000 for each in design.curve}
        grown = {name: less | {("", ""): design.tasks[name].steps / 1000} for name in tasks}
        made["updates"] = _grown(grown, results, "updates [thousand]")
    if sized := {name: task for name in tasks if (task := design.tasks[name]).sizes}:
        less = {name: {(f" {size:g} min", ""): size for size in task.sizes} for name, task in sized.items()}
        grown = {name: each | {("", ""): sized[name].minutes} for name, each in less.items()}
        made["amounts"] = _grown(grown, results, "operator's time [min]")
    return made


def _disturbed(task: str, results: Results) -> list[StudyCondition]:
    """Return what was disturbed or protected; no policies that only have learnt less."""
    less = {after(updates) for updates in results.progress.design.curve}
    return [each for each in results.of_task(task, treated=True) if each.treatment not in less]


def _panels(tasks: Sequence[str], height: float, **shared: Any) -> tuple[Any, Iterator[tuple[Any, str]]]:
    """Return a figure with one panel a task, and its axes with their tasks."""
    figure = new_figure(_WIDTH, height)
    grid = figure.subplots(1, len(tasks), squeeze=False, **shared)[0]
    for axes, task in zip(grid, tasks, strict=True):
        axes.set(title=task.replace("_", " "))
    return figure, zip(grid, tasks, strict=True)


def _contrasts(found: Sequence[Contrast]) -> Any:
    """The declared contrasts over all tasks, and beneath them the same of each task, which explore."""
    shown: list[tuple[str, Contrast]] = []
    for each in (each for each in found if each.family == DECLARED and each.interval):
        shown.append((each.label, each))
        same = (c for c in found if (c.label, c.measure) == (each.label, each.measure) and c is not each)
        shown += [(f"{c.scope} (exploratory)", c) for c in same if c.interval]
    figure = new_figure(_WIDTH, 0.9 + 0.34 * len(shown))
    axes = figure.subplots()
    for row, (_, each) in enumerate(shown):
        colour, width, size = (INK, 2.4, 7) if each.family == DECLARED else (GREY, 1.2, 4)
        axes.plot(np.multiply(100, each.interval or (0, 0)), [row, row], color=colour, lw=width)
        axes.plot(100 * (each.estimate or 0.0), row, "o", color=colour, ms=size)
    axes.axvline(0.0, color=GREY, lw=0.8)
    axes.set_xlabel("difference in policy success [points], 95 %")
    rows(axes, [name for name, _ in shown], 80)
    return figure


def _style(condition: StudyCondition, results: Results) -> dict[str, Any]:
    """Return how a condition is drawn: the mode's colour, the action's mark; an intent is no policy alone."""
    modes, policy = results.progress.design.modes, condition.learners[0]
    mark = "D" if policy.actions == "intent" else "s" if policy.budget == "number" else "o"
    colour = COLOURS[modes.index(policy.cell.mode) % len(COLOURS)]
    name = condition.label.replace(" intent", ":\nintent through MPC").replace(" same", ",\nsame")
    return {"color": colour, "marker": mark, "label": name}


def _answer(tasks: Sequence[str], results: Results) -> Any:
    """One panel a task: success of every condition; a line: 95 %, ticks: draws."""
    figure, panels = _panels(tasks, 1.2 + 0.4 * max(len(results.of_task(task)) for task in tasks))
    for axes, task in panels:
        styles = [_style(each, results) for each in results.of_task(task)]
        draw_values(axes, [each.value for each in results.of_task(task)], styles, 100.0)
        axes.set(xlabel="policy success [%]", xlim=(-3, 103), ylim=(len(styles) - 0.4, -0.6))
        axes.set(yticks=range(len(styles)), yticklabels=[style["label"] for style in styles])
        tidy(axes, "x")
    return figure


def _draw(axes: Any, places: FloatArray, found: Sequence[StudyCondition], **style: Any) -> None:
    """Draw the success of conditions at some places, each with its 95 %."""
    values = np.array([each.value.estimate for each in found])
    errors = np.abs(np.array([each.value.interval for each in found]).T - values)
    axes.errorbar(places, 100 * values, yerr=100 * errors, **style)


def _finish(figure: Any) -> None:
    """Say what the height of all panels is; name beside them, once, what is drawn."""
    figure.axes[0].set(ylabel="policy success [%], 95 %", ylim=(-3, 103))
    pairs = [zip(*axes.get_legend_handles_labels(), strict=True) for axes in figure.axes]
    known = {label: handle for each in pairs for handle, label in each}
    place = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    figure.axes[-1].legend(known.values(), known.keys(), fontsize=8, frameon=False, **place)


def _rounds(tasks: Sequence[str], ways: Sequence[str], results: Results) -> Any:
    """One panel a task: success after every round, a line each way, all from the same policy on."""
    figure, panels = _panels(tasks, 3.2, sharey=True)
    for axes, task in panels:
        sizes, found = results.progress.design.tasks[task], results.of_task(task)
        for place, way in enumerate(ways):
            shown = [each for each in found if (cell := each.learners[0].cell).mode == way or not cell.before]
            rounds = np.array([len(each.learners[0].cell.rounds) - 1 for each in shown])
            minutes = sizes.minutes + rounds * sizes.round_minutes
            shift = 0.02 * (place - 1) * sizes.round_minutes
            style = {"color": COLOURS[place], "marker": "o", "lw": 1.4, "elinewidth": 1.0, "ms": 4}
            _draw(axes, minutes + shift, shown, label=way, **style)
        axes.set_xlabel("operator's time [min]")
        tidy(axes, "y")
    _finish(figure)
    return figure


def _grown(stages: Mapping[str, _Stages], results: Results, over: str) -> Any:
    """One panel a task: success of the policies of joint velocities over their updates, or their data."""
    modes = results.progress.design.modes
    figure, panels = _panels(list(stages), 3.2, sharey=True)
    for axes, task in panels:
        for place, mode in enumerate(modes):
            shown = {
                at: found
                for (ending, treatment), at in stages[task].items()
                if (found := results.find(task, mode + ending, treatment))
            }
            if not shown:
                continue
            found = list(shown.values())
            shift = 0.006 * (place - 0.5 * (len(modes) - 1)) * stages[task]["", ""]  # side by side
            style = _style(found[0], results) | {"label": mode, "elinewidth": 1.2, "ms": 5}
            _draw(axes, np.array([*shown]) + shift, found, **style)
        axes.set_xlabel(over)
        tidy(axes)
    _finish(figure)
    return figure


def _robustness(tasks: Sequence[str], results: Results) -> Any:
    """One panel a task: success of every condition under every treatment, and of the same draws without."""
    figure, panels = _panels(tasks, 3.2, sharey=True)
    for axes, task in panels:
        treated = _disturbed(task, results)
        names = ["", *dict.fromkeys(each.treatment for each in treated)]
        labels = list(dict.fromkeys(each.label for each in treated))
        for place, label in enumerate(labels):
            mine = [each for name in names if (each := results.find(task, label, name))]
            shown = [each for one in mine if (each := one.beside(mine[-1]))]
            shift = 0.5 * ((place + 0.5) / len(labels) - 0.5)
            xs = np.array([names.index(each.treatment) for each in shown]) + shift
            _draw(axes, xs, shown, **_style(shown[0], results) | {"ls": "", "elinewidth": 1.2, "ms": 5})
        axes.set_xticks(range(len(names)), ["without", *names[1:]], rotation=20)
        tidy(axes, "y")
    _finish(figure)
    return figure

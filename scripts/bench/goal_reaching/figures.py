"""The benchmark's figures, and an example of it to look at: controllers on the same goal, in step."""

from collections.abc import Callable, Mapping, Sequence
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from handrail.collect.session.film import captioned, contact_sheet
from handrail.collect.world.rendering import Painter
from handrail.collect.world.scene import Scene
from handrail.collect.world.simulation import Simulation
from handrail.collect.world.tasks.goal_reaching import STEP
from handrail.collect.world.tasks.reach import goal_marker
from handrail.controllers.robot.model import Pose, load_model
from handrail.datasets.presentation.drawing import COLOURS, GREY, INK, new_figure, tidy
from handrail.scripts.bench.goal_reaching.episode import Conditions
from handrail.scripts.bench.goal_reaching.metrics import METRICS, SHOWN, Trace, column, rows_of
from handrail.scripts.bench.goal_reaching.run import BenchEpisode
from handrail.scripts.bench.goal_reaching.tables import PUBLISHED

_BASE, _HAND = COLOURS[:2]
_WIDTH = 11.0  # [inch]
_DRAWN = tuple(name for name in METRICS if name not in ("success", "length"))
_LOGARITHMIC = ("final_position_error", "arm_effort", "jerkiness", "wall_time_s")
_COLUMNS = 4  # panels side by side
_BOXES = {"flierprops": {"markersize": 2}, "medianprops": {"color": _BASE, "lw": 1.6}}


def figures(
    results: Mapping[str, Any], episodes: Sequence[BenchEpisode], goals: Sequence[Pose]
) -> dict[str, Any]:
    """Return matplotlib figures by name.

    Args:
        results: as summarised.
        episodes: with the paths of some goals.
        goals: of the run.
    """
    profile, names = next(iter(results["profiles"])), list(results["controllers"])
    kept = [each for each in episodes if each.paths and each.row["profile"] == profile]
    drawn = {"distributions": _distributions(results, profile), "paths": _paths(kept, names, goals)}
    if len(results["profiles"]) > 1:
        drawn["profiles"] = _profiles(results)
    if results["paired"][profile]:
        drawn["paired"] = _paired(results["paired"][profile])
    return drawn


def _panels(labels: Sequence[str], draw: Callable[[Any, str], None]) -> Any:
    """Return a figure with a panel for each measure, and a line in it for each label, from the top down."""
    figure = new_figure(_WIDTH, 1.4 + 0.55 * len(labels))
    axes = np.ravel(figure.subplots(2, 3, sharey=True))
    for ax, metric in zip(axes, _DRAWN, strict=True):
        draw(ax, metric)
        ax.set(title=SHOWN[metric][0])
        ax.set_yticks(range(len(labels)), labels)
        tidy(ax, "x")
    axes[0].invert_yaxis()
    return figure


def _distributions(results: Mapping[str, Any], profile: str) -> Any:
    """Draw every episode's measures as box plots; the published means as dashed lines."""
    names = list(results["controllers"])
    rows = [rows_of(results["episodes"], profile, name) for name in names]

    def draw(ax: Any, metric: str) -> None:
        values = [column(own, metric, known=True) for own in rows]
        ax.boxplot(values, positions=range(len(names)), orientation="horizontal", widths=0.55, **_BOXES)
        if metric in _LOGARITHMIC:
            _logarithmic(ax)
        for colour, published in zip((GREY, _HAND), PUBLISHED.values(), strict=True):
            ax.axvline(published[metric]["mean"], color=colour, ls="--", lw=1)

    return _panels(names, draw)


def _paired(differences: Mapping[str, Any]) -> Any:
    """Draw the first controller minus the others on the same goals, with bootstrap intervals."""

    def draw(ax: Any, metric: str) -> None:
        for row, entry in enumerate(differences.values()):
            low, high = entry[metric]["bootstrap_interval"]
            colour = GREY if low <= 0.0 <= high else _BASE if high < 0 else _HAND
            ax.plot([low, high], [row, row], color=colour, lw=2)
            ax.plot(entry[metric]["mean"], row, "o", color=colour, ms=4)
        ax.axvline(0.0, color=INK, lw=0.8)

    return _panels(list(differences), draw)


def _paths(episodes: Sequence[BenchEpisode], names: Sequence[str], goals: Sequence[Pose]) -> Any:
    """Draw base and hand of some goals from above, one panel a controller."""
    rows = -(-len(names) // _COLUMNS)
    figure = new_figure(_WIDTH, 2.9 * rows)
    grid = np.ravel(figure.subplots(rows, _COLUMNS, sharex=True, sharey=True, squeeze=False))
    for ax, name in zip(grid, names, strict=False):
        for episode in episodes:
            if episode.row["controller"] == name:
                style = "-" if episode.row["success"] else ":"
                for path, colour in zip(episode.paths, (_BASE, _HAND), strict=True):
                    ax.plot(*path.T, color=colour, lw=1.0, ls=style)
                ax.plot(*goals[episode.row["goal"]].position[:2], "*", color=INK, ms=5)
        ax.set(title=name, aspect="equal")
        tidy(ax)
    for ax in grid[len(names) :]:
        ax.axis("off")
    return figure


def _profiles(results: Mapping[str, Any]) -> Any:
    """Draw success with Wilson intervals, and jerkiness, by profile."""
    figure = new_figure(_WIDTH, 6)
    upper, lower = figure.subplots(2, 1, sharex=True)
    names, profiles = list(results["controllers"]), list(results["profiles"])
    for index, name in enumerate(names):
        cells = [results["profiles"][profile][name] for profile in profiles]
        at = np.arange(len(profiles)) + 0.8 * (index - (len(names) - 1) / 2) / len(names)
        share = np.array([100.0 * cell["success"]["mean"] for cell in cells])
        ends = 100.0 * np.array([cell["success"]["interval"] for cell in cells]).T
        style = {"color": COLOURS[index % len(COLOURS)], "fmt": "o", "ms": 4}
        upper.errorbar(at, share, np.maximum(np.abs(ends - share), 0.0), label=name, lw=1, **style)
        jerk = [cell["jerkiness"]["mean"] if "jerkiness" in cell else np.nan for cell in cells]
        lower.errorbar(at, jerk, **style)
    upper.set(ylabel="success % (95 % interval)", ylim=(0, 105))
    lower.set(ylabel=SHOWN["jerkiness"][0], yscale="log")
    lower.set_xticks(range(len(profiles)), profiles)
    upper.legend(fontsize=8, ncols=5, loc="lower center")
    for ax in (upper, lower):
        tidy(ax, "y")
    return figure


def _logarithmic(axes: Any) -> None:
    """Let the values of axes rise by factors, with few plain numbers along them."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0), numticks=5))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


_SIZE = (252, 336)  # of a picture of the example [px]
_MOMENTS = 5  # of the example
_TINTS = 256  # of the example
_BAR = 44  # height of the caption [px]


def example_strip(given: Conditions, runs: Sequence[tuple[str, Trace]]) -> bytes:
    """Return runs under the same conditions as one PNG: a row each, from left to right in step.

    The robot is among the obstacles, and the goal is marked.

    Args:
        given: goal and obstacles.
        runs: who, and what happened.
    """
    steps = np.linspace(0, max(len(trace.q) for _, trace in runs) - 1, _MOMENTS).round().astype(int)
    model, marker = load_model(), goal_marker(given.goal)
    scene = Scene((*given.scene.objects, marker), given.scene.view)
    simulation = Simulation(model, scene, model.description.home, STEP, meshes=True)
    painter = Painter(_SIZE, pretty=True)
    try:
        pictures = [_panel(simulation, painter, *each, step) for each in runs for step in steps.tolist()]
    finally:
        painter.close()
    buffer = BytesIO()
    sheet = Image.fromarray(contact_sheet(pictures, columns=_MOMENTS))
    sheet.quantize(_TINTS).save(buffer, "png", optimize=True)
    return buffer.getvalue()


def _panel(simulation: Simulation, painter: Painter, who: str, trace: Trace, step: int) -> NDArray[np.uint8]:
    """Return the picture of a run at a step, over a bar that says who it is and how far from the goal."""
    index = min(step, len(trace.q) - 1)
    simulation.show(trace.q[index])
    picture = painter.paint(simulation.mujoco_model, simulation.data, "scene")
    d_p, d_r = trace.errors[max(index - 1, 0)]
    words = f"{index * STEP:4.1f} s   {d_p:.2f} m   d_r {d_r:.3f}"
    touched = sum(map(bool, trace.contacts[:index]))
    words += f"   in contact {touched * STEP:.1f} s" if touched else ""
    return captioned(picture, _BAR, (who, 5, 14), (words, 24, 12))

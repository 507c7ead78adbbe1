"""The benchmark's figures: paths from above, distributions, success by profile, paired differences."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from handrail.collect.experiments.benchmark.format import HEADINGS
from handrail.collect.experiments.benchmark.published import PUBLISHED
from handrail.collect.experiments.benchmark.run import Episode
from handrail.controllers.robot.model import Pose
from handrail.datasets.presentation.drawing import COLOURS, GREY, INK, new_figure, tidy

CAPTIONS = {
    "distributions": "Every episode's measures; dashed: means published, grey RL, orange proposed.",
    "paths": "Base (blue) and hand (orange) from above [m]; failed episodes dotted, goals as stars.",
    "profiles": "Success with its 95 % interval, and jerkiness, by profile.",
    "paired": "The first controller minus the others on the same goals, with 95 % bootstrap intervals;"
    " blue below zero, orange above, grey where zero is inside.",
}
_BASE, _HAND = COLOURS[:2]
_WIDTH = 11.0  # [inch]
_SHOWN = (
    "final_position_error",
    "final_orientation_error",
    "arm_effort",
    "base_path",
    "jerkiness",
    "wall_time_s",
)
_COLUMNS = 4  # panels side by side


def figures(results: Mapping[str, Any], episodes: Sequence[Episode], goals: Sequence[Pose]) -> dict[str, Any]:
    """Return matplotlib figures by name.

    Args:
        results: as summarised.
        episodes: with the paths of some goals.
        goals: of the run.
    """
    profile = next(iter(results["profiles"]))
    kept = [e for e in episodes if e.base is not None and e.row["profile"] == profile]
    drawn = {
        "distributions": lambda: _distributions(results, profile),
        "paths": lambda: _paths(kept, list(results["controllers"]), goals),
    }
    if len(results["profiles"]) > 1:
        drawn["profiles"] = lambda: _profiles(results)
    if results["paired"][profile]:
        drawn["paired"] = lambda: _paired(results, profile)
    return {name: draw() for name, draw in drawn.items()}


def _distributions(results: Mapping[str, Any], profile: str) -> Any:
    """Draw every episode's measures as box plots; the published means as dashed lines."""
    names = list(results["controllers"])
    figure = new_figure(_WIDTH, 1.4 + 0.55 * len(names))
    axes = np.ravel(figure.subplots(2, 3, sharey=True))
    for ax, metric in zip(axes, _SHOWN, strict=True):
        columns = [_column(results, profile, name, metric) for name in names]
        ax.boxplot(
            columns,
            orientation="horizontal",
            widths=0.55,
            flierprops={"markersize": 2},
            medianprops={"color": _BASE, "lw": 1.6},
        )
        ax.set_yticks(range(1, len(names) + 1), names)
        if metric in ("arm_effort", "jerkiness", "wall_time_s", "final_position_error"):
            _logarithmic(ax)
        for colour, published in zip((GREY, _HAND), PUBLISHED.items(), strict=True):
            ax.axvline(published[1][metric]["mean"], color=colour, ls="--", lw=1)
        ax.set_title(HEADINGS[metric])
        tidy(ax, "x")
    axes[0].invert_yaxis()
    return figure


def _paths(episodes: Sequence[Episode], names: Sequence[str], goals: Sequence[Pose]) -> Any:
    """Draw base and hand of some goals from above, one panel a controller."""
    rows = -(-len(names) // _COLUMNS)
    figure = new_figure(_WIDTH, 2.9 * rows)
    grid = np.ravel(figure.subplots(rows, _COLUMNS, sharex=True, sharey=True, squeeze=False))
    for ax, name in zip(grid, names, strict=False):
        for episode in episodes:
            if episode.row["controller"] == name and episode.base is not None and episode.hand is not None:
                style = {"lw": 1.0, "ls": "-" if episode.row["success"] else ":"}
                ax.plot(*episode.base.T, color=_BASE, **style)
                ax.plot(*episode.hand.T, color=_HAND, **style)
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
    width = 0.8 / len(names)
    for index, name in enumerate(names):
        cells = [results["profiles"][profile][name] for profile in profiles]
        at = np.arange(len(profiles)) + (index - (len(names) - 1) / 2) * width
        share = np.array([100.0 * cell["success"]["mean"] for cell in cells])
        ends = 100.0 * np.array([cell["success"]["interval"] for cell in cells]).T
        error = np.maximum(np.abs(ends - share), 0.0)
        upper.bar(
            at,
            share,
            width,
            yerr=error,
            error_kw={"lw": 0.6},
            label=name,
            color=COLOURS[index % len(COLOURS)],
        )
        jerk = [cell["jerkiness"]["mean"] if "jerkiness" in cell else np.nan for cell in cells]
        lower.bar(at, jerk, width, color=COLOURS[index % len(COLOURS)])
    upper.set(ylabel="success % (95 % interval)", ylim=(0, 105))
    lower.set(ylabel=HEADINGS["jerkiness"], yscale="log")
    lower.set_xticks(range(len(profiles)), profiles)
    upper.legend(fontsize=8, ncols=5, loc="lower center")
    for ax in (upper, lower):
        tidy(ax, "y")
    return figure


def _paired(results: Mapping[str, Any], profile: str) -> Any:
    """Draw the first controller minus the others on the same goals, with bootstrap intervals."""
    differences = results["paired"][profile]
    figure = new_figure(_WIDTH, 1.4 + 0.55 * len(differences))
    axes = np.ravel(figure.subplots(2, 3, sharey=True))
    for ax, metric in zip(axes, _SHOWN, strict=True):
        for row, entry in enumerate(differences.values()):
            low, high = entry[metric]["bootstrap_interval"]
            colour = GREY if low <= 0.0 <= high else _BASE if high < 0 else _HAND
            ax.plot([low, high], [row, row], color=colour, lw=2)
            ax.plot(entry[metric]["mean"], row, "o", color=colour, ms=4)
        ax.axvline(0.0, color=INK, lw=0.8)
        ax.set_title(HEADINGS[metric])
        ax.set_yticks(range(len(differences)), list(differences))
        tidy(ax, "x")
    axes[0].invert_yaxis()
    return figure


def _column(results: Mapping[str, Any], profile: str, name: str, metric: str) -> np.ndarray:
    values = np.array(
        [
            np.nan if row[metric] is None else row[metric]
            for row in results["episodes"]
            if row["profile"] == profile and row["controller"] == name
        ],
        dtype=float,
    )
    return values[np.isfinite(values)]


def _logarithmic(axes: Any) -> None:
    """Let the values of axes rise by factors, with few plain numbers along them."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0), numticks=5))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())

"""The figure of a case: paths from above, distances and tracking error over time."""

import io
from pathlib import Path
from typing import Any

import numpy as np

from handrail.collect.experiments.showcase.metrics import held_error, tracking_error
from handrail.collect.experiments.showcase.run import Trace
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import not_installed
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import RobotModel
from handrail.datasets.storage.atomic import write_whole

_BASE, _HAND, _GREY, _OBSTACLE = "#2a6fbb", "#c8402f", "#666666", "#e0a050"
_FARTHEST = 0.5  # distance that is shown [m]
_GHOSTS = 6  # moments at which the robot is drawn


def save_figure(trace: Trace, model: RobotModel, margin: float, path: Path) -> None:
    """Write the figure as a picture file.

    Args:
        trace: of the run.
        model: of the robot.
        margin: of the controller [m].
        path: of the picture.

    Raises:
        HandrailError: matplotlib is not installed.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise not_installed("the figure", "matplotlib") from error
    figure = Figure(dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    above, upper, lower = _panels(figure, _extent(trace, model))
    figure.suptitle(trace.case.title, fontsize=13)
    _paths(above, trace, model)
    _distances(upper, trace, margin)
    _errors(lower, trace)
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    write_whole(path, stream.getvalue())


def _extent(trace: Trace, model: RobotModel) -> FloatArray:
    """Return how far the robot gets along x and y, the chassis included, (2,) [m]."""
    places = np.vstack([trace.q[:, :2], trace.hand[:, :2]])
    return np.ptp(places, axis=0) + model.description.base_size


def _panels(figure: Any, extent: FloatArray) -> tuple[Any, Any, Any]:
    """Return the axes of paths, distances and errors; wide paths on top of the others."""
    if extent[0] > 2.0 * extent[1]:
        figure.set_size_inches(11, 8.6)
        grid = figure.add_gridspec(2, 2, height_ratios=(1.2, 1.0))
        places = grid[0, :], grid[1, 0], grid[1, 1]
    else:
        figure.set_size_inches(13, 6.2)
        grid = figure.add_gridspec(2, 2, width_ratios=(1.4, 1.0))
        places = grid[:, 0], grid[0, 1], grid[1, 1]
    above, upper, lower = (figure.add_subplot(place) for place in places)
    return above, upper, lower


def _paths(axes: Any, trace: Trace, model: RobotModel) -> None:
    from matplotlib.patches import Circle

    for item in trace.case.scene.objects:
        if not item.ghost:
            x, y, radius = *item.position[:2].tolist(), float(item.shape.size[0])
            axes.add_patch(Circle((x, y), radius, facecolor=_OBSTACLE, zorder=1))
            axes.annotate(item.name, (x, y), ha="center", va="center", fontsize=8)
    for index in np.linspace(0, len(trace.q) - 1, _GHOSTS).round().astype(int):
        _robot(axes, trace.q[index], model, 0.25 + 0.5 * index / len(trace.q))
    axes.plot(*trace.q[:, :2].T, color=_BASE, lw=2.2, label="base", zorder=5)
    axes.plot(*trace.hand[:, :2].T, color=_HAND, lw=2.2, label="hand", zorder=6)
    if trace.case.held:
        axes.plot(*trace.case.held[:2], "*", color=_HAND, ms=15, mec="white", label="held point", zorder=7)
    axes.set(xlabel="x [m]", ylabel="y [m]", title="from above", aspect="equal")
    axes.legend(loc="upper left", framealpha=0.9)
    _tidy(axes)


def _robot(axes: Any, q: FloatArray, model: RobotModel, alpha: float) -> None:
    """Draw the chassis' outline and the arm at q."""
    length, width = model.description.base_size
    corners = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]]) * [length, width]
    axes.plot(*(turned(corners.T, q[2]).T + q[:2]).T, color=_BASE, lw=1.0, alpha=alpha, zorder=2)
    frames = [shape.frame for shape in model.description.collision if shape.frame != "planar_base"]
    points = [model.pose(q, frame).position[:2] for frame in (*dict.fromkeys(frames), "tool")]
    axes.plot(*np.array(points).T, color=_GREY, lw=2.2, alpha=alpha, zorder=3, solid_capstyle="round")


def _distances(axes: Any, trace: Trace, margin: float) -> None:
    obstacles = {item.name for item in trace.case.scene.obstacles()}
    scene = np.array([bool({*pair} & obstacles) for pair in trace.pairs])
    floor = np.array(["floor" in pair for pair in trace.pairs])
    groups = (
        ("to obstacles", scene, _HAND),
        ("to itself", ~scene & ~floor & ~trace.own_margin, _BASE),
        ("to itself: " + _names(trace), trace.own_margin, "#7fb0e0"),
        ("to the floor", floor, _GREY),
    )
    for label, which, colour in groups:
        smallest = trace.distances[:, which].min(axis=1, initial=np.inf)
        if smallest.min() < _FARTHEST:
            axes.plot(trace.times, smallest, color=colour, lw=1.6, label=label)
    axes.axhline(margin, color="black", lw=1.0, ls="--", label=f"margin {margin:g} m")
    axes.set(ylabel="smallest signed distance [m]", xlabel="time [s]", ylim=(0.0, _FARTHEST))
    axes.legend(fontsize=8, loc="upper right", framealpha=0.9)
    _tidy(axes)


def _names(trace: Trace) -> str:
    return ", ".join("–".join(pair) for pair, own in zip(trace.pairs, trace.own_margin, strict=True) if own)


def _errors(axes: Any, trace: Trace) -> None:
    error, cruise = tracking_error(trace), np.linalg.norm(trace.asked, axis=1).max()
    mean = error.mean() / cruise if cruise else 0.0
    what = "hand" if trace.case.channels[0].startswith("ee") else "base"
    label = f"{what} velocity error, mean {mean:.2%} of {cruise:.2f} m/s"
    axes.plot(trace.times, 1e3 * error, color="black", lw=1.4, label=label)
    axes.axhline(10.0 * cruise, color="black", lw=0.8, ls=":", label=f"1 % of {cruise:.2f} m/s")
    axes.set(xlabel="time [s]", ylabel="tracking error [mm/s]", ylim=(0.0, 1.4e3 * error.max()))
    handles, labels = axes.get_legend_handles_labels()
    if trace.case.held:
        held = axes.twinx()
        held.plot(trace.times, 1e3 * held_error(trace), color=_HAND, lw=1.4, label="hand")
        held.set_ylabel("hand off the held point [mm]", color=_HAND)
        held.set_ylim(0.0, 1.4e3 * held_error(trace).max())
        more = held.get_legend_handles_labels()
        handles, labels = handles + more[0], labels + more[1]
    axes.legend(handles, labels, fontsize=8, loc="upper center", framealpha=0.9)
    _tidy(axes)


def _tidy(axes: Any) -> None:
    axes.grid(color="#dddddd", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)

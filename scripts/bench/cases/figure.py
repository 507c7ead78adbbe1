"""The figure of a case: paths from above, distances and tracking error over time."""

from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import RobotModel
from handrail.datasets.presentation.drawing import COLOURS, GREY, INK, new_figure, tidy
from handrail.scripts.bench.cases.trace import CaseTrace

_BASE, _HAND, _OBSTACLE, _OWN = COLOURS[0], COLOURS[1], COLOURS[4], COLOURS[5]
_FARTHEST = 0.5  # distance that is shown [m]
_GHOSTS = 6  # moments at which the robot is drawn


def case_figure(trace: CaseTrace, model: RobotModel, margin: float) -> Any:
    """Return the figure.

    Args:
        trace: of the run.
        model: of the robot.
        margin: of the controller [m].
    """
    places = np.vstack([trace.q[:, :2], *trace.hands.swapaxes(0, 1)[..., :2]])
    length, width = np.ptp(places, axis=0) + model.description.base.size
    if length > 2.0 * width:  # paths on top of the others
        figure, layout = new_figure(11, 8.6), [["paths", "paths"], ["distances", "errors"]]
    else:
        figure, layout = new_figure(13, 6.2), [["paths", "distances"], ["paths", "errors"]]
    axes = figure.subplot_mosaic(layout)
    figure.suptitle(trace.case.title, fontsize=13)
    _paths(axes["paths"], trace, model)
    _distances(axes["distances"], trace, margin)
    _errors(axes["errors"], trace)
    for each in axes.values():
        tidy(each)
    return figure


def _paths(axes: Any, trace: CaseTrace, model: RobotModel) -> None:
    from matplotlib.patches import Circle

    for item in trace.case.scene.objects:
        if not item.ghost:
            x, y, radius = *item.position[:2].tolist(), float(item.shape.size[0])
            axes.add_patch(Circle((x, y), radius, facecolor=_OBSTACLE, zorder=1))
            axes.annotate(item.name, (x, y), ha="center", va="center", fontsize=8)
    for index in np.linspace(0, len(trace.q) - 1, _GHOSTS).round().astype(int):
        _robot(axes, trace.q[index], model, 0.25 + 0.5 * index / len(trace.q))
    axes.plot(*trace.q[:, :2].T, color=_BASE, lw=2.2, label="base", zorder=5)
    for k, path in enumerate(trace.hands.swapaxes(0, 1)):
        axes.plot(*path[:, :2].T, color=_HAND, lw=2.2, label="_hand" if k else "hand", zorder=6)
    if trace.case.held:
        held = np.array(trace.case.held)[:, :2].T
        axes.plot(*held, "*", color=_HAND, ms=15, mec="white", label="held point", zorder=7)
    axes.set(xlabel="x [m]", ylabel="y [m]", title="from above", aspect="equal")
    axes.legend(loc="upper left")


def _robot(axes: Any, q: FloatArray, model: RobotModel, alpha: float) -> None:
    """Draw the chassis' outline and the arm at q."""
    length, width = model.description.base.size
    corners = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]]) * [length, width]
    axes.plot(*(turned(corners.T, q[2]).T + q[:2]).T, color=_BASE, lw=1.0, alpha=alpha, zorder=2)
    frames = [shape.frame for shape in model.description.collision if shape.frame != "planar_base"]
    for hand in model.description.hands:
        arm = (*(frame for frame in dict.fromkeys(frames) if hand.name in frame), hand.named("tool"))
        points = [model.pose(q, frame).position[:2] for frame in arm]
        axes.plot(*np.array(points).T, color=GREY, lw=2.2, alpha=alpha, zorder=3, solid_capstyle="round")


def _distances(axes: Any, trace: CaseTrace, margin: float) -> None:
    obstacles = {item.name for item in trace.case.scene.obstacles()}
    scene = np.array([bool({*pair} & obstacles) for pair in trace.pairs])
    floor = np.array(["floor" in pair for pair in trace.pairs])
    groups = (
        ("to obstacles", scene, _HAND),
        ("to itself", ~scene & ~floor & ~trace.own_margin, _BASE),
        ("to itself, pairs with a smaller margin", trace.own_margin, _OWN),
        ("to the floor", floor, GREY),
    )
    for label, which, colour in groups:
        smallest = trace.distances[:, which].min(axis=1, initial=np.inf)
        if smallest.min() < _FARTHEST:
            axes.plot(trace.times, smallest, color=colour, lw=1.6, label=label)
    axes.axhline(margin, color=INK, lw=1.0, ls="--", label=f"margin {margin:g} m")
    axes.set(ylabel="smallest signed distance [m]", xlabel="time [s]", ylim=(0.0, _FARTHEST))
    axes.legend(fontsize=8, loc="upper right")


def _errors(axes: Any, trace: CaseTrace) -> None:
    error, cruise = 1e3 * trace.tracking_error, trace.cruise
    what = "hand" if trace.case.channels[0].startswith("ee") else "base"
    label = f"{what}: mean {error.mean():.1f} mm/s of {1e3 * cruise:.0f}"
    axes.plot(trace.times, error, color=INK, lw=1.4, label=label)
    axes.axhline(10.0 * cruise, color=INK, lw=0.8, ls=":", label=f"1 % of {cruise:.2f} m/s")
    if trace.case.held:
        held = 1e3 * trace.held_error
        axes.plot(trace.times, held, color=_HAND, lw=1.4, label="hand off the held point [mm]")
    axes.set(xlabel="time [s]", ylabel="tracking error [mm/s]", ylim=(0.0, None))
    axes.legend(fontsize=8, loc="upper center")

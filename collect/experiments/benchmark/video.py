"""An example of the benchmark to look at: controllers on the same goal, in step, as a video or a strip."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from handrail.collect.experiments.benchmark.catalogue import Baseline
from handrail.collect.experiments.benchmark.episode import Conditions
from handrail.collect.experiments.benchmark.metrics import Trace
from handrail.collect.session.contact_sheet import contact_sheet
from handrail.collect.session.video_file import VideoFile
from handrail.collect.simulation.rendering import Painter
from handrail.collect.simulation.scene import Scene
from handrail.collect.simulation.simulation import Simulation
from handrail.collect.tasks.goal_reaching import STEP
from handrail.collect.tasks.reach import goal_marker
from handrail.controllers.robot.model import RobotModel

_SIZE = (360, 480)  # of one picture of the video [px]
_SMALL = (252, 336)  # of one in a strip [px]
_MOMENTS = 5  # of a strip
_COLOURS = 256  # of a strip
_BAR = 44  # height of the caption [px]
_EVERY = 3  # steps between pictures
_REST = 10  # pictures after the end


def film(
    model: RobotModel,
    conditions: Conditions,
    runs: Sequence[tuple[Baseline, Trace]],
    path: Path,
) -> None:
    """Write the video of some runs under the same conditions.

    Args:
        model: of the robot.
        conditions: goal and obstacles.
        runs: who, and what happened.
        path: of the file, .mp4.

    Raises:
        HandrailError: there is no OpenGL on this machine.
    """
    longest = max(len(trace.q) for _, trace in runs)
    size = (_SIZE[0] + _BAR, _SIZE[1] * len(runs))
    rate = 1 / (_EVERY * Fraction(STEP).limit_denominator(1000))
    with _stage(model, conditions, _SIZE) as stage, VideoFile(path, size, rate) as video:
        for step in range(0, longest + _REST * _EVERY, _EVERY):
            video.add(np.hstack([_panel(*stage, who, trace, step) for who, trace in runs]))


def strip(model: RobotModel, conditions: Conditions, runs: Sequence[tuple[Baseline, Trace]]) -> bytes:
    """Return some runs under the same conditions as one PNG: a row each, from left to right in step.

    Args:
        model: of the robot.
        conditions: goal and obstacles.
        runs: who, and what happened.

    Raises:
        HandrailError: there is no OpenGL on this machine.
    """
    longest = max(len(trace.q) for _, trace in runs)
    steps = np.linspace(0, longest - 1, _MOMENTS).round().astype(int).tolist()
    with _stage(model, conditions, _SMALL) as stage:
        pictures = [_panel(*stage, who, trace, step) for who, trace in runs for step in steps]
    sheet = Image.fromarray(contact_sheet(pictures, columns=_MOMENTS))
    buffer = BytesIO()
    sheet.quantize(_COLOURS).save(buffer, "png", optimize=True)
    return buffer.getvalue()


@contextmanager
def _stage(
    model: RobotModel, conditions: Conditions, size: tuple[int, int]
) -> Iterator[tuple[Simulation, Painter]]:
    """Give the robot among the obstacles, with the goal marked, and who paints it at a size."""
    scene = Scene((*conditions.scene.objects, goal_marker(conditions.goal)), conditions.scene.view)
    simulation = Simulation(model, scene, model.description.home, STEP, meshes=True)
    painter = Painter(simulation.mujoco_model, size, pretty=True)
    try:
        yield simulation, painter
    finally:
        painter.close()


def _panel(
    simulation: Simulation, painter: Painter, who: Baseline, trace: Trace, step: int
) -> NDArray[np.uint8]:
    """Return the picture of a run at a step, over a bar that says who it is and how far from the goal."""
    index = min(step, len(trace.q) - 1)
    simulation.show(trace.q[index])
    picture = painter.paint(simulation.data, "scene")
    d_p, d_r = trace.errors[max(index - 1, 0)]
    height, width, _ = picture.shape
    image = Image.new("RGB", (width, height + _BAR), (24, 26, 30))
    image.paste(Image.fromarray(picture))
    draw = ImageDraw.Draw(image)
    draw.text((10, height + 5), who.help, font=ImageFont.load_default(14), fill=(245, 245, 245))
    words = f"{index * STEP:4.1f} s   {d_p:.2f} m   d_r {d_r:.3f}"
    touched = sum(map(bool, trace.contacts[:index]))
    words += f"   in contact {touched * STEP:.1f} s" if touched else ""
    draw.text((10, height + 24), words, font=ImageFont.load_default(12), fill=(190, 195, 205))
    return np.array(image)

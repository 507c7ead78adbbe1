"""An example of the benchmark to look at: controllers on the same goal, in step, as a video or a strip."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from handrail.collect.session.film import VideoFile, captioned, contact_sheet
from handrail.collect.world.rendering import Painter
from handrail.collect.world.scene import Scene
from handrail.collect.world.simulation import Simulation
from handrail.collect.world.tasks.goal_reaching import STEP
from handrail.collect.world.tasks.reach import goal_marker
from handrail.controllers.robot.model import Pose, load_model
from handrail.scripts.bench.goal_reaching.episode import Conditions
from handrail.scripts.bench.goal_reaching.metrics import Trace

_SIZE = (360, 480)  # of one picture of the video [px]
_SMALL = (252, 336)  # of one in a strip [px]
_MOMENTS = 5  # of a strip
_COLOURS = 256  # of a strip
_BAR = 44  # height of the caption [px]
EVERY = 3  # steps between pictures
_REST = 10  # pictures after the end


@dataclass(frozen=True)
class Example:
    """Some runs under the same conditions.

    Attributes:
        conditions: goal and obstacles.
        runs: who, and what happened.
    """

    conditions: Conditions
    runs: Sequence[tuple[str, Trace]]

    def film(self, path: Path) -> None:
        """Write them as a video, side by side."""
        size = (_SIZE[0] + _BAR, _SIZE[1] * len(self.runs))
        rate = 1 / (EVERY * Fraction(STEP).limit_denominator(1000))
        steps = range(0, self._longest + _REST * EVERY, EVERY)
        with VideoFile(path, size, rate) as video:
            for pictures in self._pictures(steps, _SIZE):
                video.add(np.hstack(pictures))

    def strip(self) -> bytes:
        """Return them as one PNG: a row each, from left to right in step."""
        steps = np.linspace(0, self._longest - 1, _MOMENTS).round().astype(int).tolist()
        rows = zip(*self._pictures(steps, _SMALL), strict=True)
        sheet = Image.fromarray(contact_sheet([each for row in rows for each in row], columns=_MOMENTS))
        buffer = BytesIO()
        sheet.quantize(_COLOURS).save(buffer, "png", optimize=True)
        return buffer.getvalue()

    @property
    def _longest(self) -> int:
        return max(len(trace.q) for _, trace in self.runs)

    def _pictures(self, steps: Sequence[int], size: tuple[int, int]) -> Iterator[list[NDArray[np.uint8]]]:
        """Yield the pictures of all runs, step by step: the robot among the obstacles, the goal marked."""
        model, given = load_model(), self.conditions
        marker = goal_marker(Pose(given.goal.position, given.goal.rotation))
        scene = Scene((*given.scene.objects, marker), given.scene.view)
        simulation = Simulation(model, scene, model.description.home, STEP, meshes=True)
        painter = Painter(size, pretty=True)
        try:
            for step in steps:
                yield [_panel(simulation, painter, who, trace, step) for who, trace in self.runs]
        finally:
            painter.close()


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

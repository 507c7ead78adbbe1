"""The paper's three cases: scene, start, mask, command; nothing of the controller."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from handrail.collect.world.scene import Colour, Scene, SceneObject, Viewpoint
from handrail.collect.world.tasks.furniture import pillar
from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.interface.frames import Frames
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.shape import Shape

_RAMP = 1.0  # how long a command takes to reach full speed, and to end [s]
_HAND, _BASE = (0.85, 0.25, 0.15, 0.9), (0.15, 0.45, 0.85, 0.9)  # colours of what is asked
_AHEAD = (1.262, -0.7854, 1.5708, -0.7854, 1.0, 1.31)  # arm: hand ahead, palm clear of the forearm
_ASIDE = (1.86, *_AHEAD[1:])  # the hand to the left
_RADIUS, _TURN = 0.25, 12.0  # of case C's circle [m], and its period [s]
_START = np.array([0.0134, 0.39])  # where the base stands when the hand is at the held point
_HELD = (1.5, 0.4, 0.7)


@dataclass(frozen=True)
class PaperCase:
    """One case.

    Attributes:
        name: a, b or c.
        title: one line.
        scene: obstacles, markers, camera.
        q: where the robot starts, (n,).
        seconds: how long [s].
        channels: what the operator commands.
        command: time [s] and length of the run [s] → values of these channels.
        frames: in which frames they are meant.
        held: point where the hand is held by the hold objective [m]; empty when it is switched off.
    """

    name: str
    title: str
    scene: Scene
    q: FloatArray
    seconds: float
    channels: tuple[str, ...]
    command: Callable[[float, float], FloatArray]
    frames: Frames = field(default_factory=Frames)
    held: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Copy the array and make it read-only."""
        object.__setattr__(self, "q", frozen(self.q))


def cases() -> Mapping[str, PaperCase]:
    """Return the three cases by name."""
    return {case.name: case for case in (_hand_forward(), _base_forward(), _base_circle())}


def _hand_forward() -> PaperCase:
    scene = Scene(
        (
            pillar("low_1", 1.3, -0.4, 0.3, 0.3),
            pillar("low_2", 3.0, 0.9, 0.3, 0.3),
            _line("asked", (-0.013, 0.01, 0.004), (3.987, 0.01, 0.004), _HAND),
        ),
        Viewpoint(position=(0.8, -4.9, 3.3), target=(1.0, 0.15, 0.35), fovy=38.0),
    )
    return PaperCase(
        name="a",
        title="A: the operator steers the hand forward; the base goes round the low obstacles",
        scene=scene,
        q=np.array([-1.5, 0.0, 0.0, *_AHEAD]),
        seconds=21.0,
        channels=("ee.vx", "ee.vy", "ee.vz"),
        command=lambda time, end: np.array([0.2 * _ramp(time, end), 0.0, 0.0]),
    )


def _base_forward() -> PaperCase:
    scene = Scene(
        (
            pillar("tall_1", 1.5, 1.0, 0.25, 1.5),
            pillar("tall_2", 2.2, 0.7, 0.25, 1.5),
            _line("asked", (-1.5, 0.0, 0.004), (1.0, 0.0, 0.004), _BASE),
        ),
        Viewpoint(position=(-1.0, -3.8, 3.1), target=(0.4, 0.35, 0.6), fovy=38.0),
    )
    return PaperCase(
        name="b",
        title="B: the operator drives the base forward; the arm keeps clear of the obstacles",
        scene=scene,
        q=np.array([-1.5, 0.0, 0.0, *_ASIDE]),
        seconds=13.5,
        channels=("base.vx", "base.vy", "base.wz"),
        command=lambda time, end: np.array([0.2 * _ramp(time, end), 0.0, 0.0]),
    )


def _base_circle() -> PaperCase:
    centre = _START + [_RADIUS, 0.0]
    angles = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    dots = tuple(
        SceneObject(
            f"asked_{index}",
            Shape("cylinder", np.array([0.015, 0.004])),
            np.array([*(centre + _RADIUS * np.array([np.cos(angle), np.sin(angle)])), 0.002]),
            rgba=_BASE,
            ghost=True,
        )
        for index, angle in enumerate(angles)
    )
    ball = SceneObject("held", Shape("sphere", np.array([0.03])), np.array(_HELD), rgba=_HAND, ghost=True)
    return PaperCase(
        name="c",
        title="C: the operator drives the base in a circle; the hand stays at a point",
        scene=Scene(
            (*dots, ball), Viewpoint(position=(-0.7, -3.0, 2.6), target=(0.6, 0.35, 0.45), fovy=38.0)
        ),
        q=np.array([*_START, 0.0, *_AHEAD]),
        seconds=26.0,
        channels=("base.vx", "base.vy", "base.wz"),
        command=_circle,
        frames=Frames(base="world"),
        held=_HELD,
    )


def _circle(time: float, end: float) -> FloatArray:
    """Return the velocity on the circle, in the world, the turning rate ramped at both ends, (3,)."""
    rate = 2.0 * np.pi / _TURN
    angle = np.pi + rate * _ramped_time(time, end)
    speed = _RADIUS * rate * _ramp(time, end)
    return np.array([-speed * np.sin(angle), speed * np.cos(angle), 0.0])


def _ramp(time: float, end: float) -> float:
    """Return the share of full speed, `3 s² - 2 s³` within the first and the last second."""
    share = float(np.clip(min(time, end - time) / _RAMP, 0.0, 1.0))
    return share * share * (3.0 - 2.0 * share)


def _ramped_time(time: float, end: float) -> float:
    """Return the integral of `_ramp` [s]."""
    up, down = np.clip([time / _RAMP, (end - time) / _RAMP], 0.0, 1.0)
    middle = max(min(time, end - _RAMP) - _RAMP, 0.0)
    return float(_RAMP * (up**3 - up**4 / 2 + 0.5 - (down**3 - down**4 / 2)) + middle)


def _line(name: str, start: tuple[float, ...], end: tuple[float, ...], rgba: Colour) -> SceneObject:
    """Return a thin line along x that nothing touches: where the command leads."""
    middle = 0.5 * (np.array(start) + np.array(end))
    length = float(np.linalg.norm(np.subtract(end, start)))
    shape = Shape("capsule", np.array([0.006, length]))
    return SceneObject(name, shape, middle, matrix_from_rpy([0.0, np.pi / 2, 0.0]), rgba=rgba, ghost=True)

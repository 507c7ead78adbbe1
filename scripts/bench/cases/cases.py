"""The paper's three cases, and the last one with two hands; nothing of the controller."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from handrail.collect.world.scene import Colour, FrozenArrays, Scene, SceneObject, Viewpoint
from handrail.collect.world.tasks.furniture import pillar
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.frames import Frames
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.description import load_description
from handrail.controllers.robot.shape import Shape

_RAMP = 1.0  # how long a command takes to reach full speed, and to end [s]
_HAND, _BASE = (0.85, 0.25, 0.15, 0.9), (0.15, 0.45, 0.85, 0.9)  # colours of what is asked
_AHEAD = (1.262, -0.7854, 1.5708, -0.7854, 1.0, 1.31)  # arm: hand ahead, palm clear of the forearm
_ASIDE = (1.86, *_AHEAD[1:])  # the hand to the left
_TURN = 12.0  # period of the circles [s]
_START = np.array([0.0134, 0.39])  # where the base stands when the hand is at the held point
_HELD = (1.5, 0.4, 0.7)
_HANDS = ((0.759, 0.204, 0.813), (0.759, -0.204, 0.813))  # of TIAGo Pro at home, the base at 0
_OF_HAND, _OF_BASE = ("ee.vx", "ee.vy", "ee.vz"), ("base.vx", "base.vy", "base.wz")


@dataclass(frozen=True)
class PaperCase(FrozenArrays):
    """One case."""

    name: str  # a, b, c or d
    title: str  # one line
    scene: Scene  # obstacles, markers, camera
    q: FloatArray  # where the robot starts, (n,)
    seconds: float  # how long [s]
    channels: tuple[str, ...]  # what the operator commands
    command: Callable[[float, float], FloatArray]
    """Time [s] and length of the run [s] → values of these channels."""
    frames: Frames = field(default_factory=Frames)  # in which frames they are meant
    held: tuple[tuple[float, ...], ...] = ()
    """Point where each hand is held by its hold objective [m]; empty when these are switched off."""
    robot: str = "ridgeback_ur10"


def cases() -> Mapping[str, PaperCase]:
    """Return the cases by name."""
    return {case.name: case for case in (_hand_forward(), _base_forward(), _hand_held(), _hands_held())}


def _hand_forward() -> PaperCase:
    low = (pillar("low_1", 1.3, -0.4, 0.3, 0.3), pillar("low_2", 3.0, 0.9, 0.3, 0.3))
    line = _line("asked", (-0.013, 0.01, 0.004), (3.987, 0.01, 0.004), _HAND)
    view = Viewpoint(position=(0.8, -4.9, 3.3), target=(1.0, 0.15, 0.35), fovy=38.0)
    title = "A: the operator steers the hand forward; the base goes round the low obstacles"
    q = np.array([-1.5, 0.0, 0.0, *_AHEAD])
    return PaperCase("a", title, Scene((*low, line), view), q, 21.0, _OF_HAND, _forward)


def _base_forward() -> PaperCase:
    tall = (pillar("tall_1", 1.5, 1.0, 0.25, 1.5), pillar("tall_2", 2.2, 0.7, 0.25, 1.5))
    line = _line("asked", (-1.5, 0.0, 0.004), (1.0, 0.0, 0.004), _BASE)
    view = Viewpoint(position=(-1.0, -3.8, 3.1), target=(0.4, 0.35, 0.6), fovy=38.0)
    title = "B: the operator drives the base forward; the arm keeps clear of the obstacles"
    q = np.array([-1.5, 0.0, 0.0, *_ASIDE])
    return PaperCase("b", title, Scene((*tall, line), view), q, 13.5, _OF_BASE, _forward)


def _hand_held() -> PaperCase:
    title = "C: the operator drives the base in a circle; the hand stays at a point"
    return _base_circle("c", title, np.array([*_START, 0.0, *_AHEAD]), (_HELD,), 0.25, np.pi)


def _hands_held() -> PaperCase:
    robot, title = "tiago_pro", "D: the operator drives the base in a circle; both hands stay at their points"
    q = np.append(np.zeros(3), load_description(robot).home[3:])
    return _base_circle("d", title, q, _HANDS, 0.15, np.pi / 2, robot)


def _base_circle(
    name: str,
    title: str,
    q: FloatArray,
    held: tuple[tuple[float, ...], ...],
    radius: float,
    begin: float,
    robot: str = PaperCase.robot,
) -> PaperCase:
    """Return a case whose base drives a circle of a radius [m] from an angle of it [rad] on."""
    centre = q[:2] - radius * np.array([np.cos(begin), np.sin(begin)])
    dot = Shape("cylinder", np.array([0.015, 0.004]))
    ways = (np.array([np.cos(a), np.sin(a)]) for a in np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False))
    dots = (
        SceneObject(f"asked_{k}", dot, np.array([*(centre + radius * way), 0.002]), rgba=_BASE, ghost=True)
        for k, way in enumerate(ways)
    )
    balls = (
        SceneObject(f"held_{k}", Shape("sphere", np.array([0.03])), np.array(point), rgba=_HAND, ghost=True)
        for k, point in enumerate(held)
    )
    view = Viewpoint(position=(-0.7, -3.0, 2.6), target=(0.6, 0.35, 0.45), fovy=38.0)
    scene = Scene((*dots, *balls), view)
    circle = partial(_circle, radius, begin)
    return PaperCase(name, title, scene, q, 26.0, _OF_BASE, circle, Frames(base="world"), held, robot)


def _forward(time: float, end: float) -> FloatArray:
    """Return 0.2 m/s ahead, ramped at both ends, (3,)."""
    return np.array([0.2 * _ramp(time, end), 0.0, 0.0])


def _circle(radius: float, begin: float, time: float, end: float) -> FloatArray:
    """Return the velocity on the circle, in the world, the turning rate ramped at both ends, (3,)."""
    rate = 2.0 * np.pi / _TURN
    angle = begin + rate * _ramped_time(time, end)
    speed = radius * rate * _ramp(time, end)
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
    shape = Shape("capsule", np.array([0.006, float(np.linalg.norm(np.subtract(end, start)))]))
    return SceneObject(name, shape, middle, matrix_from_rpy([0.0, np.pi / 2, 0.0]), rgba=rgba, ghost=True)

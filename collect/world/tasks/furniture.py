"""Things that tasks put into scenes: tables, an open bin, cubes, a tray."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from handrail.collect.world.geometry import bounding_box
from handrail.collect.world.scene import Colour, Part, SceneObject, box
from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.shape import Shape

WOOD: Colour = (0.72, 0.56, 0.40, 1.0)
CABINET: Colour = (0.87, 0.86, 0.83, 1.0)
STEEL: Colour = (0.45, 0.47, 0.50, 1.0)
_RED: Colour = (0.85, 0.16, 0.14, 1.0)
_BIN: Colour = (0.20, 0.42, 0.70, 1.0)
_CONE: Colour = (0.90, 0.45, 0.10, 1.0)
CRATE: Colour = (0.55, 0.58, 0.36, 1.0)
_TRAY: Colour = (0.30, 0.55, 0.42, 1.0)

BAR = 0.03  # width and height of a handle [m]
BAR_LENGTH = 0.11  # of the handle at a side [m]
SIDES = (-1.0, 1.0)


def block(size: tuple[float, float, float], at: ArrayLike, rgba: Colour | None = None) -> Part:
    """Return a box with full lengths at a place in an object's frame [m]."""
    return Part(box(size), np.array(at), rgba=rgba)


def standing(
    name: str, shape: Shape, x: float, y: float, bottom: float = 0.0, yaw: float = 0.0, **options: Any
) -> SceneObject:
    """Return an upright thing that stands at a height [m], turned by `yaw` [rad]."""
    position = np.array([x, y, bottom + bounding_box(shape)[2] / 2])
    turn = {"rotation": matrix_from_rpy([0.0, 0.0, yaw])} if yaw else {}
    return SceneObject(name, shape, position, **turn, **options)


def table(name: str, x: float, y: float, size: tuple[float, float, float], scale: float = 1.0) -> SceneObject:
    """Return a solid table on the floor, centred at x, y; size is depth, width, height [m]."""
    depth, width, height = size
    slab, inset = 0.04 * scale, 0.03 * scale
    parts = (
        block((depth, width, slab), [0.0, 0.0, (height - slab) / 2]),
        block((depth - 2 * inset, width - 2 * inset, height - slab), [0.0, 0.0, -slab / 2], CABINET),
    )
    return standing(name, box(size), x, y, rgba=WOOD, work_surface=True, parts=parts)


def cube(
    x: float, y: float, bottom: float, yaw: float, edge: float, mass: float, length: float = 0.0
) -> SceneObject:
    """Return a cube that can be grasped, standing at height `bottom` [m], turned by `yaw` [rad].

    With a `length` it is a bar, so long along its y [m].
    """
    looks, size = {"rgba": _RED, "turns": 2 if length else 4}, [edge, length or edge, edge]
    return standing("cube", box(size), x, y, bottom, yaw, mass=mass, friction=1.0, **looks)


def open_bin(x: float, y: float, bottom: float, inner: float, height: float, scale: float) -> SceneObject:
    """Return a square bin without a lid, 1 cm · scale thick; to the controller it is one box [m]."""
    wall = 0.01 * scale
    outer = inner + 2 * wall
    parts = [block((outer, outer, wall), [0.0, 0.0, (wall - height) / 2])]
    for side in SIDES:
        away = side * (inner + wall) / 2
        parts.append(block((wall, outer, height - wall), [away, 0.0, wall / 2]))
        parts.append(block((inner, wall, height - wall), [0.0, away, wall / 2]))
    looks = {"rgba": _BIN, "work_surface": True, "parts": tuple(parts)}
    return standing("bin", box([outer, outer, height]), x, y, bottom, **looks)


def pillar(name: str, x: float, y: float, radius: float, height: float) -> SceneObject:
    """Return a cylinder that stands on the floor [m]."""
    return standing(name, Shape("cylinder", np.array([radius, height])), x, y, rgba=_CONE)


def footprint(item: SceneObject) -> float:
    """Return the radius of the circle around an upright object, seen from above [m]."""
    size = item.shape.size
    return float(np.hypot(*size[:2]) / 2) if item.shape.kind == "box" else float(size[0])


def tray(
    name: str, handle: FloatArray, rotation: FloatArray, size: tuple[float, float, float], mass: float
) -> SceneObject:
    """Return a tray with a rim and an arched handle to hold it by from above.

    Its frame is at the centre of the plate's upper face, z up, the handle's bar along y.

    Args:
        name: unique in the scene.
        handle: centre of the handle's bar, (3,) [m].
        rotation: world from tray, (3, 3).
        size: length along x, width along y, height of the bar above the plate's upper face [m].
        mass: [kg].
    """
    length, width, height = size
    thick, rim, bar = 0.01, 0.012, BAR
    x, y = length / 2 - thick / 2, width / 2 - thick / 2
    parts = [block((length, width, thick), [0.0, 0.0, -thick / 2])]
    for side in SIDES:
        parts.append(block((thick, width, rim), [side * x, 0.0, rim / 2]))
        parts.append(block((length - 2 * thick, thick, rim), [0.0, side * y, rim / 2]))
        parts.append(block((bar, thick, height - rim), [0.0, side * y, (rim + height) / 2], STEEL))
    parts.append(block((bar, width, bar), [0.0, 0.0, height], STEEL))
    shape = box([length, width, 2 * (height + bar)])
    position = handle - rotation @ np.array([0.0, 0.0, height])
    looks = {"rgba": _TRAY, "parts": tuple(parts)}
    return SceneObject(name, shape, position, rotation, mass=mass, friction=0.35, **looks)


def crate(
    name: str, x: float, y: float, bottom: float, yaw: float, size: tuple[float, float, float], mass: float
) -> SceneObject:
    """Return an open box with a bar that sticks out on either side, along its y, to be lifted by both.

    Args:
        name: unique in the scene.
        x: of its centre [m].
        y: likewise [m].
        bottom: height that it stands at [m].
        yaw: how it is turned [rad].
        size: its lengths without the bars [m].
        mass: [kg].
    """
    length, width, height = size
    thick, at = 0.012, height / 2 - BAR / 2
    parts = [block((length, width, thick), [0.0, 0.0, (thick - height) / 2])]
    for side in SIDES:
        parts.append(block((thick, width, height), [side * (length - thick) / 2, 0.0, 0.0]))
        parts.append(block((length, thick, height), [0.0, side * (width - thick) / 2, 0.0]))
        parts.append(block((BAR, BAR_LENGTH, BAR), [0.0, side * (width + BAR_LENGTH) / 2, at], STEEL))
    shape = box([length, width + 2 * BAR_LENGTH, height])
    looks = {"rgba": CRATE, "parts": tuple(parts)}
    return standing(name, shape, x, y, bottom, yaw, mass=mass, friction=0.8, **looks)


def can(name: str, position: FloatArray, radius: float, height: float, mass: float) -> SceneObject:
    """Return an upright can centred at a place, (3,) [m]."""
    shape = Shape("cylinder", np.array([radius, height]))
    return SceneObject(name, shape, position, rgba=_RED, mass=mass, friction=0.35)

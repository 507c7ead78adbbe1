"""A cabinet with one drawer that can be pulled open by its handle."""

import numpy as np

from handrail.collect.world.scene import Colour, Part, SceneObject, Slide, box
from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import matrix_from_rpy

_BODY: Colour = (0.87, 0.86, 0.83, 1.0)
_FRONT: Colour = (0.72, 0.56, 0.40, 1.0)
_STEEL: Colour = (0.45, 0.47, 0.50, 1.0)
_DEPTH, _WIDTH, _WALL = 0.45, 0.50, 0.02  # of the cabinet [m]
_TALL, _GAP = 0.20, 0.006  # of the drawer's opening, and the play around the drawer [m]
_BAR, _LENGTH, _STANDOFF = 0.018, 0.16, 0.055  # of the handle, and from the front to its centre [m]
_MASS = 2.5  # of the drawer [kg]
TRAVEL = 0.35  # of the drawer [m]
DROP = _WALL + _TALL / 2  # of the drawer's middle below the cabinet's top [m]
HANDLE = np.array([-_DEPTH / 2 - _STANDOFF, 0.0, 0.0])  # in the drawer's frame, closed [m]


def cabinet(name: str, x: float, y: float, yaw: float, height: float) -> SceneObject:
    """Return the body: its front, to −x of its own frame, has an opening under the top [m, rad]."""
    inner, below = _WIDTH - 2 * _WALL, height - _WALL - _TALL
    side = (_WIDTH - _WALL) / 2
    parts = [
        Part(box([_DEPTH, _WIDTH, _WALL]), np.array([0.0, 0.0, (height - _WALL) / 2])),
        Part(box([_DEPTH, _WIDTH, below]), np.array([0.0, 0.0, (below - height) / 2])),
        Part(box([_WALL, inner, _TALL]), np.array([(_DEPTH - _WALL) / 2, 0.0, height / 2 - DROP])),
    ]
    parts += [
        Part(box([_DEPTH, _WALL, _TALL]), np.array([0.0, sign * side, height / 2 - DROP]))
        for sign in (-1.0, 1.0)
    ]
    return SceneObject(
        name,
        box([_DEPTH, _WIDTH, height]),
        np.array([x, y, height / 2]),
        matrix_from_rpy([0.0, 0.0, yaw]),
        rgba=_BODY,
        work_surface=True,
        parts=tuple(parts),
    )


def drawer(name: str, body: SceneObject) -> SceneObject:
    """Return the drawer of a cabinet, closed; it opens along −x of its frame."""
    width, tall = _WIDTH - 2 * _WALL - 2 * _GAP, _TALL - 2 * _GAP
    depth, deep = _DEPTH - _WALL - _GAP, 0.6 * tall
    front, thin = -_DEPTH / 2, 0.012
    middle = front + depth / 2
    parts = [
        Part(box([_WALL, width, tall]), np.array([front + _WALL / 2, 0.0, 0.0])),
        Part(box([depth, width, thin]), np.array([middle, 0.0, (thin - tall) / 2])),
        Part(box([thin, width, deep]), np.array([front + depth - thin / 2, 0.0, (deep - tall) / 2])),
        Part(box([_BAR, _LENGTH, _BAR]), HANDLE, rgba=_STEEL),
    ]
    for sign in (-1.0, 1.0):
        parts.append(
            Part(box([depth, thin, deep]), np.array([middle, sign * (width - thin) / 2, (deep - tall) / 2]))
        )
        post = np.array([front - _STANDOFF / 2, sign * (_LENGTH - _BAR) / 2, 0.0])
        parts.append(Part(box([_STANDOFF, _BAR, _BAR]), post, rgba=_STEEL))
    return SceneObject(
        name,
        box([_DEPTH, width, tall]),
        np.array([*body.position[:2], body.top - DROP]),
        body.rotation,
        rgba=_FRONT,
        mass=_MASS,
        parts=tuple(parts),
        slide=Slide(np.array([-1.0, 0.0, 0.0]), TRAVEL),
    )


def inward(rotation: FloatArray) -> FloatArray:
    """Return the direction into the cabinet, in the world, (3,)."""
    return rotation[:, 0]

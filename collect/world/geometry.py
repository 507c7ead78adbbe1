"""Shapes, poses and inertias of the controllers' vocabulary, in MuJoCo's."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from handrail.collect.world.gl import MjsBody, mujoco
from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import quaternion_from_matrix
from handrail.controllers.robot.shape import Shape

# Who may touch whom: a pair collides when one's type meets the other's affinity; the floor's: `stage.xml`.
SCENE_BIT, ROBOT_BIT, FLOOR_BIT = 1, 2, 4
VISIBLE_GROUP, HIDDEN_GROUP = 1, 3
UNTOUCHED = {"contype": 0, "conaffinity": 0}


def geom_shape(shape: Shape) -> dict[str, Any]:
    """Return the `type` and `size` of a geom; MuJoCo takes half lengths."""
    size = np.zeros(3)
    size[: len(shape.size)] = shape.size
    return {
        "type": getattr(mujoco.mjtGeom, f"mjGEOM_{shape.kind.upper()}"),
        "size": size / ([2.0] * 3 if shape.kind == "box" else [1.0, 2.0, 1.0]),
    }


def pose(translation: FloatArray, rotation: FloatArray) -> dict[str, Any]:
    """Return the `pos` and `quat` of a body, geom, site or camera."""
    return {"pos": np.array(translation), "quat": quaternion_from_matrix(rotation)}


def camera_pose(position: FloatArray, right: FloatArray, forward: FloatArray) -> dict[str, Any]:
    """Return the pose of a camera that looks forward, (3,) each; MuJoCo's look along their −z with y up."""
    return pose(position, np.column_stack([right, np.cross(right, forward), -forward]))


def set_box_inertia(body: MjsBody, mass: float, size: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0)) -> None:
    """Give a body the mass [kg] and inertia of a solid box with full lengths `size` [m] around a centre."""
    x, y, z = np.square(size)
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat = mass, np.array(centre), [1.0, 0.0, 0.0, 0.0]
    body.inertia = mass / 12.0 * np.array([y + z, x + z, x + y])


def volume(shape: Shape) -> float:
    """Return the volume of a shape [m³]."""
    if shape.kind == "box":
        return float(np.prod(shape.size))
    radius = shape.size[0]
    ball = 0.0 if shape.kind == "cylinder" else 4.0 / 3.0 * np.pi * radius**3
    return float(ball + (np.pi * radius**2 * shape.size[1] if len(shape.size) > 1 else 0.0))


def box_around(solids: Iterable[tuple[Shape, FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """Return full lengths and centre of the smallest box along the axes around shapes, (3,) each [m].

    Args:
        solids: shape, position of its centre, (3,), and rotation, (3, 3), of each.
    """
    lower, upper = np.full(3, np.inf), np.full(3, -np.inf)
    for shape, position, rotation in solids:
        half = np.abs(rotation) @ bounding_box(shape) / 2
        lower, upper = np.minimum(lower, position - half), np.maximum(upper, position + half)
    return upper - lower, (lower + upper) / 2


def bounding_box(shape: Shape) -> FloatArray:
    """Return the full lengths of the box around a shape in its own frame, (3,) [m]."""
    if shape.kind == "box":
        return np.array(shape.size)
    radius = shape.size[0]
    length = shape.size[1] if len(shape.size) > 1 else 0.0
    return np.array([2 * radius, 2 * radius, length + (0.0 if shape.kind == "cylinder" else 2 * radius)])

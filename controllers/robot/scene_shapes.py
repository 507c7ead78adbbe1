"""Which of a robot's shapes can meet the scene and the floor: derived from how the robot moves."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel, joints_of
from handrail.controllers.robot.parts import PlacedShape
from handrail.controllers.robot.shape import Shape

_UNEVEN = 0.05  # how far a floor may rise above the base's [m]


@dataclass(frozen=True)
class _Height:
    """Bounds on the height of a joint's origin at every configuration."""

    lowest: float  # bound on it [m]
    up: FloatArray | None
    """The vertical in the joint's axes, (3,), while no joint has tilted it; None after one has."""
    varies: bool  # whether any joint changes the height of what this joint carries


@lru_cache(maxsize=8)
def scene_shapes(model: RobotModel) -> tuple[str, ...]:
    """Return the names of the shapes that move: all of them keep from what stands around."""
    return tuple(placed.name for placed in model.description.collision if model.mount(placed)[0] > 0)


@lru_cache(maxsize=8)
def floor_shapes(model: RobotModel) -> tuple[str, ...]:
    """Return the names of the shapes that can come near the floor, and whose height the joints change."""
    heights = _heights(model)
    return tuple(
        placed.name
        for placed in model.description.collision
        if heights[model.mount(placed)[0]].varies and lowest_height(model, placed) < _UNEVEN
    )


def lowest_height(model: RobotModel, placed: PlacedShape) -> float:
    """Return a bound on how low a shape can come at any configuration within the limits [m].

    Up to the first joint that tilts the heights are exact; from there on the chain hangs straight down:
    `z ≥ z_joint − Σ |offsets| − reach of the shape`.
    """
    joint, placement = model.mount(placed)
    height = _heights(model)[joint]
    if height.up is None:
        return height.lowest - _farthest(placed.shape, placement)
    up = placement.rotation.T @ height.up
    return float(height.lowest + height.up @ placement.translation - _extent(placed.shape, up))


@lru_cache(maxsize=8)
def _heights(model: RobotModel) -> tuple[_Height, ...]:
    heights = [_Height(0.0, np.array([0.0, 0.0, 1.0]), False)]
    for joint in range(1, model.pinocchio.njoints):
        heights.append(_next_height(model, joint, heights[model.pinocchio.parents[joint]]))
    return tuple(heights)


def _next_height(model: RobotModel, joint: int, parent: _Height) -> _Height:
    """Return the height of a joint whose parent's is known."""
    here, limits = joints_of(model)[joint - 1], model.description.limits
    travel = np.array([limits.position_lower[joint - 1], limits.position_upper[joint - 1]])
    if parent.up is None:
        slack = float(np.abs(travel).max()) if here.prismatic else 0.0
        return _Height(parent.lowest - float(np.linalg.norm(here.translation)) - slack, None, True)
    up = here.rotation.T @ parent.up
    lift = float(up @ here.axis) if here.prismatic else 0.0
    lowest = float(parent.lowest + parent.up @ here.translation + np.min(lift * travel))
    tilts = not here.prismatic and float(np.linalg.norm(np.cross(here.axis, up))) > 1e-6
    return _Height(lowest, None if tilts else up, parent.varies or tilts or abs(lift) > 1e-6)


def _extent(shape: Shape, direction: FloatArray) -> float:
    """Return how far a shape reaches from its centre in a direction of its own axes, a unit vector [m]."""
    if shape.kind == "box":
        return float(np.abs(direction) @ shape.size) / 2
    if shape.kind == "sphere":
        return float(shape.size[0])
    along, radius = abs(float(direction[2])) * shape.size[1] / 2, shape.size[0]
    return float(along + (radius if shape.kind == "capsule" else radius * np.hypot(*direction[:2])))


def _farthest(shape: Shape, placement: pin.SE3) -> float:
    """Return the distance of a shape's farthest point from the origin that it is placed from [m]."""
    centre = np.abs(placement.rotation.T @ placement.translation)
    if shape.kind == "box":
        return float(np.linalg.norm(centre + shape.size / 2))
    if shape.kind == "sphere":
        return float(np.linalg.norm(centre) + shape.size[0])
    side, end = float(np.hypot(*centre[:2])), float(centre[2] + shape.size[1] / 2)
    if shape.kind == "capsule":
        return float(np.hypot(side, end) + shape.size[0])
    return float(np.hypot(side + shape.size[0], end))

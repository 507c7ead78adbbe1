"""How far a coordinate can move a shape: what bounds distances along a way without measuring them."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.parts import PlacedShape
from handrail.controllers.robot.shape import Shape


class Joint(NamedTuple):
    """A joint: its coordinate, axis, placement on its parent, and how far it slides; None if it turns."""

    index: int
    parent: int
    axis: FloatArray
    translation: FloatArray
    rotation: FloatArray
    travel: float | None


def motion_bounds(model: RobotModel, placed: PlacedShape) -> FloatArray:
    """Return bounds on how far a point of a shape moves per unit of each coordinate, (n,) [m].

    1 for a prismatic joint, 0 for one that does not move it; for a revolute one the largest distance to its
    axis. The shape lies in a ball; so does, seen from the joint's parent, all that a joint makes of a ball:
    one that turns leaves of its centre what lies along the axis, and reaches as far as it was aside.
    """
    joints, bounds = joints_of(model), np.zeros(model.size)
    number, placement = model.mount(placed)
    centre, radius = placement.translation, _radius(placed.shape)
    while number > 0:
        joint = joints[number]
        if joint.travel is None:
            along = (joint.axis @ centre) * joint.axis
            radius += float(np.linalg.norm(centre - along))
            centre, bounds[joint.index] = along, radius
        else:
            radius += joint.travel
            bounds[joint.index] = 1.0
        centre = joint.translation + joint.rotation @ centre
        number = joint.parent
    return bounds


def _radius(shape: Shape) -> float:
    """Return how far from its centre a shape reaches [m]."""
    if shape.kind == "box":
        return 0.5 * float(np.linalg.norm(shape.size))
    radius, half = shape.size[0], 0.5 * shape.size[1:].sum()
    return float(np.hypot(radius, half) if shape.kind == "cylinder" else radius + half)


@lru_cache(maxsize=8)
def joints_of(model: RobotModel) -> tuple[Joint, ...]:
    """Return the joints by their numbers; the first, which is the world, moves nothing."""
    pinocchio, limits = model.pinocchio, model.description.limits
    data, found = pinocchio.createData(), []
    columns = pin.computeJointJacobians(pinocchio, data, pin.neutral(pinocchio))
    farthest = np.maximum(np.abs(limits.position_lower), np.abs(limits.position_upper))
    for number in range(1, pinocchio.njoints):
        index, placement = pinocchio.joints[number].idx_v, pinocchio.jointPlacements[number]
        turns = bool(columns[3:, index].any())
        axis = data.oMi[number].rotation.T @ (columns[3:, index] if turns else columns[:3, index])
        travel = None if turns else float(farthest[index])
        parts = placement.translation.copy(), placement.rotation.copy()
        found.append(Joint(index, pinocchio.parents[number], axis, *parts, travel))
    return (Joint(-1, 0, np.zeros(3), np.zeros(3), np.eye(3), 0.0), *found)

"""How far a coordinate can move a shape: what bounds distances along a way without measuring them."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel, joints_of
from handrail.controllers.robot.parts import PlacedShape
from handrail.controllers.robot.shape import Shape


def motion_bounds(model: RobotModel, placed: PlacedShape) -> FloatArray:
    """Return bounds on how far a point of a shape moves per unit of each coordinate, (n,) [m].

    1 for a prismatic joint, 0 for one that does not move it; for a revolute one the largest distance to its
    axis. The shape lies in a ball; so does, seen from the joint's parent, all that a joint makes of a ball:
    one that turns leaves of its centre what lies along the axis, and reaches as far as it was aside.
    """
    joints, limits, bounds = joints_of(model), model.description.limits, np.zeros(model.size)
    farthest = np.maximum(np.abs(limits.position_lower), np.abs(limits.position_upper))
    number, placement = model.mount(placed)
    centre, radius = placement.translation, _radius(placed.shape)
    while number > 0:
        joint = joints[number - 1]
        if joint.prismatic:
            radius += float(farthest[number - 1])
            bounds[number - 1] = 1.0
        else:
            along = (joint.axis @ centre) * joint.axis
            radius += float(np.linalg.norm(centre - along))
            centre, bounds[number - 1] = along, radius
        centre = joint.translation + joint.rotation @ centre
        number = joint.parent
    return bounds


def _radius(shape: Shape) -> float:
    """Return how far from its centre a shape reaches [m]."""
    if shape.kind == "box":
        return 0.5 * float(np.linalg.norm(shape.size))
    radius, half = shape.size[0], 0.5 * shape.size[1:].sum()
    return float(np.hypot(radius, half) if shape.kind == "cylinder" else radius + half)

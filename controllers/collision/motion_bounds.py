"""How far a robot's shapes can move: bounds that hold at every configuration."""

from functools import lru_cache

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.description import PlacedShape
from handrail.controllers.robot.model import RobotModel


@lru_cache(maxsize=8)
def all_motion_bounds(model: RobotModel) -> dict[str, FloatArray]:
    """Return the motion bounds of every shape of a robot, by name."""
    return {shape.name: motion_bounds(model, shape) for shape in model.description.collision}


def motion_bounds(model: RobotModel, placed: PlacedShape) -> FloatArray:
    """Return bounds on how far a point of a shape moves per unit of each coordinate, (n,) [m].

    1 for a prismatic joint; for a revolute one the length of the chain from its axis to the shape, and the
    shape's own size; 0 for a joint that does not move it.
    """
    pinocchio, arms = model.pinocchio, np.zeros(model.size)
    frame = pinocchio.frames[model.frame_id(placed.frame)]
    size = float(np.linalg.norm(placed.shape.size)) if placed.shape.kind == "box" else placed.shape.size.sum()
    radius = size + float(
        np.linalg.norm(frame.placement.translation + frame.placement.rotation @ placed.placement.translation)
    )
    joint = frame.parentJoint
    while joint > 0:
        prismatic = pinocchio.joints[joint].shortname().startswith("JointModelP")
        arms[pinocchio.joints[joint].idx_v] = 1.0 if prismatic else radius
        radius += float(np.linalg.norm(pinocchio.jointPlacements[joint].translation))
        joint = pinocchio.parents[joint]
    return arms

"""Goals of the hand that a robot gets to: any pose, or those of an arm that cannot point everywhere."""

import numpy as np

from handrail.collect.tasks.goal_reaching import sample_goal
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.inverse_kinematics import body_configuration
from handrail.controllers.robot.model import Pose, RobotModel

_MOST_TRIES = 200
_REACHED = 1e-3  # error of the hand's pose that is left [m, rad]
_CLEAR = 0.12  # kept to itself and to the floor there, at scale 1 [m]


def sample_goal_for(model: RobotModel, rng: np.random.Generator) -> Pose:
    """Draw a goal in a robot's world.

    An arm of six joints or more points everywhere: a goal of the paper's, its place made to the measure of
    the robot's world. A shorter one gets the hand's heading, pitch and roll, and only goals that it can reach
    from some place of the base, clear of itself and of the floor.

    Raises:
        HandrailError: it reached none of those that were tried.
    """
    description = model.description
    world, joints = description.world, len(description.arm_joints)
    lower, upper = (-world.scale, -world.scale, world.goals[0]), (world.scale, world.scale, world.goals[1])
    if joints >= 6:
        return sample_goal(rng, lower, upper)
    collision = CollisionModel(model)
    for _ in range(_MOST_TRIES):
        goal = Pose(rng.uniform(lower, upper), _rotation(world.pitch, world.roll, rng))
        if _is_reached(model, collision, goal, _CLEAR * world.scale):
            return goal
    raise HandrailError(
        f"task Reach: expected a robot that reaches its goals, got {description.name}, "
        f"which reached none of {_MOST_TRIES}"
    )


def _rotation(pitch: tuple[float, float], roll: tuple[float, float], rng: np.random.Generator) -> FloatArray:
    """Return a hand with any heading; pitch 0 points ahead, π/2 down; x of roll 0 points down, then back."""
    yaw = rng.uniform(-np.pi, np.pi)
    ahead = matrix_from_rpy([0.0, rng.uniform(*pitch), yaw]) @ np.array(
        [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]
    )
    return ahead @ matrix_from_rpy([0.0, 0.0, rng.uniform(*roll)])


def _is_reached(model: RobotModel, collision: CollisionModel, goal: Pose, clear: float) -> bool:
    q, error = body_configuration(model, model.description.home, goal)
    return error < _REACHED and float(np.min(collision.values(q[None]))) >= clear

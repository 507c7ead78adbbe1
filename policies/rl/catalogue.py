"""The learned base as a controller and a teleop mode, by entry points: floors below do not know of it."""

from handrail.collect.operators.modes import TeleopMode, always
from handrail.controllers.baselines.catalogue import ControllerSpec
from handrail.controllers.robot.description import RobotDescription, load_description

ROBOT = "ridgeback_ur10"
"""The robot that the actor was trained on."""


def has_its_arm(robot: RobotDescription) -> bool:
    """Return whether a robot has the joints and arm of `ROBOT`; a UR5 has joints of the same names."""
    known = load_description(ROBOT)
    links = ([arm.urdf.read_bytes() for arm in each.arms] for each in (known, robot))
    return robot.joints == known.joints and next(links) == next(links)


CONTROLLER = ControllerSpec(
    "rl",
    "handrail.policies.rl.controller:RlController",
    f"a base learned by reinforcement with {ROBOT}, damped least squares on the arm",
    fits=has_its_arm,
    aims=True,
)
MODE = TeleopMode(
    "rl",
    always("hand"),
    "rl",
    "steer the hand; a base learned by reinforcement comes along: ee without the MPC",
)

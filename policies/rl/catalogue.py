"""The learned base as a controller and a teleop mode, by entry points: floors below do not know of it."""

from handrail.collect.operators.modes import TeleopMode, always
from handrail.controllers.baselines.catalogue import ControllerSpec

CONTROLLER = ControllerSpec(
    "rl",
    "handrail.policies.rl.controller:RlController",
    "a base learned by reinforcement, damped least squares on the arm",
    fits=lambda robot: len(robot.base.joints) == 3 and len(robot.joints) == 9,
)
MODE = TeleopMode(
    "rl",
    always("hand"),
    "rl",
    "steer the hand; a base learned by reinforcement comes along: ee without the MPC",
)

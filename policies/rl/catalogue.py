"""The learned base as a controller and a teleop mode, by entry points: floors below do not know of it."""

from handrail.collect.operators.modes import TeleopMode, always
from handrail.controllers.baselines.catalogue import ControllerSpec

JOINTS = ("x", "y", "theta") + tuple(
    f"{name}_joint" for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
)
"""Of the robot that the actor was trained on: a Ridgeback with a UR10."""
CONTROLLER = ControllerSpec(
    "rl",
    "handrail.policies.rl.controller:RlController",
    "a base learned by reinforcement, damped least squares on the arm",
    fits=lambda robot: tuple(robot.joints) == JOINTS,
    aims=True,
)
MODE = TeleopMode(
    "rl",
    always("hand"),
    "rl",
    "steer the hand; a base learned by reinforcement comes along: ee without the MPC",
)

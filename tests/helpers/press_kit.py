"""A package from outside: a task in one file, a mode, an operator, a controller and a robot."""

from dataclasses import dataclass

import numpy as np

from handrail.collect.operators.catalogue import OperatorSpec
from handrail.collect.operators.modes import TeleopMode, always
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.scripted import scripted_operator
from handrail.collect.operators.scripted.steering import MotionGoal, Target, hand_twist
from handrail.collect.world.scene import Scene
from handrail.collect.world.task import Start, Task, Verdict
from handrail.collect.world.tasks.catalogue import TaskSpec
from handrail.controllers.baselines.catalogue import ControllerSpec
from handrail.controllers.baselines.twist_completion import TwistController, WholeBodyCompletion
from handrail.controllers.robot.catalogue import ROBOTS, RobotSpec
from handrail.controllers.robot.model import Pose


@dataclass(frozen=True)
class Press(Task):
    """Bring the tool within 4 cm of a button near it."""

    description: str = "Press the button."
    time_limit: float = 20.0
    state_names: tuple[str, ...] = ("button.x", "button.y", "button.z")

    def sample(self, model, rng):
        hand = model.pose(model.description.home)
        button = Pose(hand.position + rng.uniform(0.05, 0.15, 3), hand.rotation)
        return Start(Scene(()), model.description.home, button)

    def features(self, state):
        return state.goal.position

    def outcome(self, state):
        return Verdict(bool(np.linalg.norm(state.tool.position - state.goal.position) < 0.04))


class PressScript:
    """Goes to the button; a script."""

    def __init__(self, model, gains, drives):
        self._gains = gains

    def reset(self, view):
        pass

    def motion_goal(self, view):
        button = view.task.goal
        twist = hand_twist(view.tool, button, self._gains)
        return MotionGoal(twist, np.zeros(3), target=Target(button, view.state.q[:3]))


def dls(model, period):
    return TwistController(model, WholeBodyCompletion(model), period)


def robot_like(model, mode, task, human):
    return scripted_operator(model, mode, task, HumanSettings().scaled(0.0))


PRESS = TaskSpec("press", Press, PressScript, "press a button")
DLS = ControllerSpec("dls", dls, "damped least squares")
HAND = TeleopMode("hand", always("ee"), "press_kit:DLS", "steer the hand by damped least squares")
EXACT = OperatorSpec("exact", robot_like, "a hand without faults")
TWIN = RobotSpec("twin", ROBOTS["ridgeback_ur10"].file)

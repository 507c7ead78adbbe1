"""Shared by the tests of input devices: an operator whose command is integrated without physics."""

import numpy as np
from collect_helpers import environment

from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.scripted import ScriptedOperator, gains_of
from handrail.collect.operators.scripted.steering import MotionGoal, Target
from handrail.collect.world.task import TaskState
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.baselines.unprotected import split_controller
from handrail.controllers.interface.controller import State
from handrail.controllers.robot.model import Pose, load_model

MODEL = load_model()
HOME = np.array(MODEL.description.home)
PERIOD = 0.05
PERFECT = HumanSettings().scaled(0.0)
GOAL = Pose(MODEL.pose(HOME).position + [0.10, -0.10, 0.15], MODEL.pose(HOME).rotation)


class Wisher:
    """Wants the base moved first, then the hand at the goal, then rests; a script."""

    def __init__(self, base_until=1.0):
        self._until = base_until

    def reset(self, view):
        pass

    def motion_goal(self, view):
        stand = HOME[:3] + [0.2, 0.1, 0.0]
        hand = np.concatenate([GOAL.position - view.tool.position, np.zeros(3)])
        focus = "base" if view.state.time < self._until else "hand"
        return MotionGoal(hand, np.array([0.3, 0.1, 0.0]), focus, target=Target(GOAL, stand, distance=0.02))


def first_view() -> View:
    """Return what an operator sees at the beginning of an episode."""
    with environment("Reach") as env:
        env.reset(seed=0)
        return View(env.state(), env.task_state())


def drive(view, mode, human, seconds=12.0, script=None, start=HOME, seed=0):
    """Integrate what the operator asks for, without physics; return intents and configurations."""
    mode = MODES[mode]
    operator = ScriptedOperator(MODEL, script or Wisher(), mode, human, gains_of(MODEL, mode, human))
    controller = split_controller(MODEL) if mode.controller == "split" else DirectController(MODEL)
    q, v, intents, path = start.copy(), np.zeros(MODEL.size), [], [start.copy()]
    operator.reset(at(view, q, v, 0.0), np.random.default_rng(seed))
    for step in range(int(seconds / PERIOD)):
        now = at(view, q, v, step * PERIOD)
        intents.append(operator.act(now))
        v = controller.update(now.state, intents[-1]).velocity(PERIOD)
        q = q + PERIOD * v
        path.append(q)
    return intents, np.array(path)


def at(view, q, v, time) -> View:
    task = TaskState(time, (MODEL.pose(q),), (1.0,), view.task.start, view.task.poses)
    return View(State(q, v, time), task)

"""The robot that the benchmark drives: an ideal one, or MuJoCo's."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from handrail.collect.simulation.gate import Gate
from handrail.collect.simulation.ideal_robot import IdealRobot
from handrail.collect.simulation.protocols import Plant
from handrail.collect.simulation.scene import Scene
from handrail.collect.simulation.simulation import Simulation
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel

PHYSICS: Mapping[str, Any] = {"grips": False, "timestep": 0.005}
"""MuJoCo's robot: its fingers do not move, and the integrator's longest step [s]."""


def plant(physics: bool) -> Callable[..., Plant]:
    """Return what makes the robot, which is sent every digit.

    MuJoCo's gripper stays open, for nothing is grasped, and without a grasp steps of 5 ms do: on six goals,
    compared with steps of 0.5 ms, no path of the hand under `mpc`, `dls` or `rl` differs by more than 1.1 mm,
    no effort by more than 0.5 %; on 300 goals, compared with 2 ms and moving fingers, ten controllers touch
    something in as many episodes, but for one of `rl`.
    """

    def made(model: RobotModel, scene: Scene, q: FloatArray, step: float, **settings: Any) -> Plant:
        gate = Gate(model, step, precision=np.float64)
        if physics:
            return Simulation(model, scene, q, step, **PHYSICS, **settings, gate=gate)
        return IdealRobot(model, scene, q, step, **settings, gate=gate)

    return made

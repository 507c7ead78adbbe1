"""The robot that the benchmark drives: an ideal one, or MuJoCo's."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from handrail.collect.simulation.scene import Scene
from handrail.collect.simulation.simulation import Simulation
from handrail.collect.tasks.goal_reaching import STEP
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.controller import State
from handrail.controllers.robot.model import Pose, RobotModel

PHYSICS: Mapping[str, Any] = {"grips": False, "timestep": 0.005}
"""MuJoCo's robot: its fingers do not move, and the integrator's longest step [s]."""


class Plant(Protocol):
    """Something that follows velocities in steps of 0.03 s."""

    def state(self) -> State:
        """Return the measured positions, velocities and time."""
        ...

    @property
    def tool(self) -> Pose:
        """The pose of the tool point."""
        ...

    def advance(self, velocity: FloatArray, gripper: float) -> tuple[str, ...]:
        """Reach a velocity linearly over one step; return the forbidden contacts on the way."""
        ...


class IdealRobot:
    """Does exactly what it is told; shapes that overlap count as contacts.

    Args:
        model: of the robot.
        scene: obstacles.
        q: where it starts, (n,).
    """

    def __init__(self, model: RobotModel, scene: Scene, q: FloatArray) -> None:
        self._model = model
        self._collision = CollisionModel(model, scene.obstacles())
        self._q, self._v = np.array(q), np.zeros(len(q))
        self._distances = self._collision.values(self._q[None])[0]
        self._steps = 0

    def state(self) -> State:
        """Return position, velocity and time."""
        return State(self._q, self._v, self._steps * STEP, self._v)

    @property
    def tool(self) -> Pose:
        """The pose of the tool point."""
        return self._model.pose(self._q)

    def advance(self, velocity: FloatArray, gripper: float) -> tuple[str, ...]:
        """Move by `½ h (v + v⁺)`; return the pairs of shapes that overlap then."""
        before = self._q
        self._q = before + 0.5 * STEP * (self._v + velocity)
        self._v = np.array(velocity, dtype=np.float64)
        self._steps += 1
        self._distances = self._collision.values(self._q[None], now=(before, self._distances))[0]
        overlaps = np.flatnonzero(self._distances < 0.0)
        return tuple(" – ".join(self._collision.pairs[index]) for index in overlaps)


def build_plant(model: RobotModel, scene: Scene, physics: bool) -> Plant:
    """Return a robot at home in a scene.

    MuJoCo's gripper stays open, for nothing is grasped, and without a grasp steps of 5 ms do: on six goals,
    compared with steps of 0.5 ms, no path of the hand under `mpc`, `dls` or `rl` differs by more than 1.1 mm,
    no effort by more than 0.5 %; on 300 goals, compared with 2 ms and moving fingers, ten controllers touch
    something in as many episodes, but for one of `rl`.
    """
    home = model.description.home
    if physics:
        return Simulation(model, scene, home, STEP, **PHYSICS)
    return IdealRobot(model, scene, home)

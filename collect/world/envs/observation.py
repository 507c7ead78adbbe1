"""What an environment shows: names, spaces and numbers of the robot's part of the observation."""

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.controller import State
from handrail.controllers.numerics.rotation import quaternion_from_matrix
from handrail.controllers.robot.model import Pose, RobotModel

_TOOL = ("tool.x", "tool.y", "tool.z", "tool.qw", "tool.qx", "tool.qy", "tool.qz")
_BOUND = 100.0  # nothing here is larger, in any unit


class AgentObservation:
    """Joint positions, velocities, gripper opening, tool pose; (2 n + 8,) float32.

    The tool's quaternion has the sign that is nearer to the one at home: a function of the pose alone, and
    without the jump that `w ≥ 0` makes where the gripper points down.
    """

    def __init__(self, model: RobotModel) -> None:
        joints = model.joints
        self.names = (
            *(f"{name}.pos" for name in joints),
            *(f"{name}.vel" for name in joints),
            "gripper.opening",
            *_TOOL,
        )
        self._home = quaternion_from_matrix(model.pose(model.description.home).rotation)

    def read(self, state: State, tool: Pose, opening: float) -> NDArray[np.float32]:
        """Return the numbers, in the order of `names`."""
        quaternion = quaternion_from_matrix(tool.rotation)
        if quaternion @ self._home < 0:
            quaternion = -quaternion
        numbers = (state.q, state.v, [opening], tool.position, quaternion)
        return bounded(np.concatenate(numbers))


def bounded(numbers: FloatArray) -> NDArray[np.float32]:
    """Return the numbers as float32 within the space's bounds."""
    within = np.clip(numbers, -_BOUND, _BOUND)
    return np.where(np.isnan(within), 0.0, within).astype(np.float32)


def box_space(size: int) -> spaces.Space[Any]:
    """Return the space of `size` bounded numbers."""
    return spaces.Box(-_BOUND, _BOUND, (size,), np.float32)

"""The last gate before a robot: whatever asks for motion, this is what is sent instead."""

import math

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from handrail.collect.world.protocols import Robot
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.safety.limiter import Limiter


class Gate:
    """Keeps what a robot is sent inside its limits, and remembers it; a robot has one.

    Args:
        model: of the robot.
        period: from one command to the next [s].
        gripper: at the beginning, 0 open, 1 closed.
        precision: of the numbers that are sent; those of a dataset by default, so that it replays exactly.

    Attributes:
        velocity: sent last, (n,) [m/s, rad/s].
        gripper: sent last.
    """

    def __init__(
        self, model: RobotModel, period: float, gripper: float = 0.0, precision: DTypeLike = np.float32
    ) -> None:
        self._limiter = Limiter(model.description)
        self._period, self._precision = period, precision
        self.velocity, self.gripper = np.zeros(model.size), gripper

    def limit(self, command: ArrayLike, q: FloatArray) -> NDArray[np.floating]:
        """Return what is sent instead of a command, (n + 1,): velocities at the end of a period, and gripper.

        A command of another size, or with a number that is not finite, brakes.

        Args:
            command: velocities [m/s, rad/s] and gripper, (n + 1,).
            q: where the robot is, (n,).
        """
        size, asked = len(self.velocity), np.asarray(command, dtype=np.float64).ravel()
        usable = asked.size == size + 1 and math.isfinite(asked[size])
        target = asked[:size] if usable else np.full(size, np.nan)
        if usable:
            self.gripper = min(max(float(asked[size]), 0.0), 1.0)
        velocity, _ = self._limiter.limit(self.velocity, target, self._period, q)
        sent = np.append(velocity, self.gripper).astype(self._precision)
        self.velocity = sent[:size].astype(np.float64)
        return sent

    def state(self) -> tuple[FloatArray, float]:
        """Return what was sent last, to come back to."""
        return self.velocity.copy(), self.gripper

    def restore(self, state: tuple[FloatArray, float]) -> None:
        """Come back to a state."""
        self.velocity, self.gripper = state[0].copy(), state[1]

    def bring_to_rest(self, robot: Robot) -> None:
        """Send its robot nothing usable, which brakes, until it was sent rest."""
        while np.abs(self.velocity).max() > 0.0:
            robot.send(())

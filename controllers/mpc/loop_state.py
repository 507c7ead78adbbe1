"""The state that the masked MPC keeps from one update to the next, as one value."""

import math
from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Prediction, after
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.interface.validation import InputHistory
from handrail.controllers.objectives.ownership import steered_joints
from handrail.controllers.ocp.problem import Plan
from handrail.controllers.robot.shape import Obstacle
from handrail.controllers.solvers.real_time import NOTHING_ACTIVE

_ROUNDING = 1e-5  # of a time, relative


class LoopState(NamedTuple):
    """The memory of a control loop. The velocity that was sent last is not in it: the robot knows that."""

    surroundings: Surroundings  # what stands around
    parameters: FloatArray  # of all objectives, (k,)
    predict: Prediction  # the intent prediction, which knows the intents so far
    inputs: InputHistory = InputHistory()  # when states and intents came
    command: Command | None = None  # that the robot follows; None before the first
    time: float = 0.0  # when that was sent [s]
    period: float = 0.0  # time from the command before it [s]
    plan: Plan | None = None  # of the last update; None where the robot follows something else
    planned: float = 0.0  # how long the command follows its plan [s]
    rest: FloatArray | None = None
    """Where joints stay that nobody steers, (n,); NaN of the others. None where all joints move each hand."""
    paired: tuple[bool, bool, bool] = False, False, False
    """Whether two hands are being steered as a pair, parted, and one of them or a joint by itself."""
    active: IntArray = NOTHING_ACTIVE
    """Names of the rows that were active in the last problem among these pairs."""

    def among(self, obstacles: tuple[Obstacle, ...]) -> "LoopState":
        """Return the state among the obstacles as they are now."""
        around = self.surroundings.among(obstacles)
        same = around.collision is self.surroundings.collision
        return self._replace(surroundings=around, active=self.active if same else NOTHING_ACTIVE)

    def facing(self, state: State, intent: Intent, channels: Channels) -> "LoopState":
        """Return the state in which the problem of a robot's state and an intent is built."""
        around, predict = self.surroundings.known_at(state.expected), after(self.predict, intent)
        rest = self.rest
        if channels.moves:
            before = np.full(len(state.q), np.nan) if rest is None else rest
            stays = np.where(np.isnan(before), state.expected, before)
            rest = np.where(steered_joints(channels, intent.mask), np.nan, stays)
        return self._replace(surroundings=around, predict=predict, rest=rest)

    def elapsed(self, time: float) -> float:
        """Return how long ago the command was sent [s]; 0 before the first.

        It is one period where the time is no number, or not later.
        """
        if self.command is None:
            return 0.0
        return time - self.time if math.isfinite(time) and time > self.time else self.period

    def following(
        self, command: Command, time: float, period: float, plan: Plan | None, planned: float
    ) -> "LoopState":
        """Return the state after a command is sent.

        Args:
            command: it.
            time: now, which may be no number [s].
            period: from one command to the next, if it is not known yet [s].
            plan: that it begins, if it does.
            planned: how long it follows that [s].
        """
        elapsed = self.elapsed(time)
        if not math.isfinite(time):
            time = self.time + elapsed
        if self.command is not None:
            period = self.period if self.command.is_over(elapsed) else elapsed
        return self._replace(command=command, time=time, period=period, plan=plan, planned=planned)

    def guess(self, time: float, horizon: int, size: int) -> FloatArray:
        """Return the accelerations that the robot follows from a time on, (N, n): the warm start."""
        if self.command is None:
            return np.zeros((horizon, size))
        elapsed = self.elapsed(time)
        followed: Trajectory = self.command
        if self.command.plan is not None and elapsed <= self.planned * (1.0 + _ROUNDING):
            followed = self.command.plan
        return followed.accelerations(horizon, elapsed)

"""What lasts from one update of the masked MPC to the next, as one value."""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Prediction, after
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.interface.validation import InputHistory
from handrail.controllers.ocp.problem import Plan
from handrail.controllers.robot.shape import Obstacle
from handrail.controllers.solvers.active_set import NOTHING_ACTIVE


@dataclass(frozen=True)
class LastCommand:
    """A command that was sent: the motion that the robot follows.

    Attributes:
        command: it.
        time: when [s].
        period: time from the command before it [s].
    """

    command: Command
    time: float
    period: float

    def elapsed(self, time: float) -> float:
        """Return how long ago it was sent [s]; one period where the time is no number, or not later."""
        return time - self.time if math.isfinite(time) and time > self.time else self.period

    def then(self, command: Command, time: float) -> "LastCommand":
        """Return the command that is sent next, at a time that may be no number [s]."""
        elapsed = self.elapsed(time)
        late = self.command.is_over(elapsed)
        now = time if math.isfinite(time) else self.time + elapsed
        return LastCommand(command, now, self.period if late else elapsed)


@dataclass(frozen=True)
class LoopState:
    """The memory of a control loop. The velocity that was sent last is not in it: the robot knows that.

    Attributes:
        surroundings: what stands around.
        parameters: of all objectives, (k,).
        predict: the intent prediction, which knows the intents so far.
        inputs: when states and intents came.
        last: the command that the robot follows; None before the first.
        plan: of the last update; None where the robot follows something else.
        stored: the motion that `Backup` goes on with; None before the first.
        active: names of the rows that were active in the last problem among these pairs.
    """

    surroundings: Surroundings
    parameters: FloatArray
    predict: Prediction
    inputs: InputHistory = field(default_factory=InputHistory)
    last: LastCommand | None = None
    plan: Plan | None = None
    stored: Trajectory | None = None
    active: IntArray = field(default_factory=lambda: NOTHING_ACTIVE)

    def among(self, obstacles: tuple[Obstacle, ...]) -> "LoopState":
        """Return the state among the obstacles as they are now."""
        around = self.surroundings.among(obstacles)
        same = around.collision is self.surroundings.collision
        return replace(self, surroundings=around, active=self.active if same else NOTHING_ACTIVE)

    def facing(self, state: State, intent: Intent) -> "LoopState":
        """Return the state in which the problem of a robot's state and an intent is built."""
        around = self.surroundings.known_at(state.q)
        return replace(self, surroundings=around, predict=after(self.predict, intent))

    def following(self, command: Command, time: float, period: float) -> LastCommand:
        """Return a command that is sent now as the last one.

        Args:
            command: it.
            time: now, which may be no number [s].
            period: from one command to the next, if it is not known yet [s].
        """
        if self.last is None:
            return LastCommand(command, time if math.isfinite(time) else 0.0, period)
        return self.last.then(command, time)

    def elapsed(self, time: float) -> float:
        """Return how long ago the last command was sent [s]; 0 before the first."""
        return 0.0 if self.last is None else self.last.elapsed(time)

    def guess(self, time: float, horizon: int, size: int) -> FloatArray:
        """Return the accelerations that the robot follows from a time on, (N, n): the warm start."""
        if self.last is None:
            return np.zeros((horizon, size))
        command = self.last.command
        followed = command if self.plan is None else Trajectory(self.plan.v, command.dt)
        return followed.accelerations(horizon, self.last.elapsed(time))

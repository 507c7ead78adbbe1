"""What lasts from one update of the masked MPC to the next, as one value."""

from dataclasses import dataclass, field, replace

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.margins import Margins
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Prediction, after
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.interface.validation import InputHistory
from handrail.controllers.mpc.last_command import LastCommand
from handrail.controllers.ocp.problem import Plan
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.shape import Obstacle
from handrail.controllers.solvers.active_set import NOTHING_ACTIVE


@dataclass(frozen=True)
class LoopState:
    """The memory of a control loop. The velocity that was sent last is not in it: the robot knows that.

    Attributes:
        surroundings: what stands around.
        margins: of its pairs.
        parameters: of all objectives, (k,).
        predict: the intent prediction, which knows the intents so far.
        inputs: when states and intents came.
        last: the command that the robot follows; None before the first.
        plan: of the last update; None where the robot follows something else.
        stored: the motion that `Backup` goes on with; None before the first.
        active: names of the rows that were active in the last problem among these pairs.
    """

    surroundings: Surroundings
    margins: Margins
    parameters: FloatArray
    predict: Prediction
    inputs: InputHistory = field(default_factory=InputHistory)
    last: LastCommand | None = None
    plan: Plan | None = None
    stored: Trajectory | None = None
    active: IntArray = field(default_factory=lambda: NOTHING_ACTIVE)

    def among(self, obstacles: tuple[Obstacle, ...], settings: MpcSettings) -> "LoopState":
        """Return the state among the obstacles as they are now; margins of what is held are kept."""
        around = self.surroundings.among(obstacles)
        if around.collision is self.surroundings.collision:
            return replace(self, surroundings=around)
        margins = Margins.of(around.collision, settings.margin, settings.work_margin, self.margins)
        return replace(self, surroundings=around, margins=margins, active=NOTHING_ACTIVE)

    def facing(self, state: State, intent: Intent) -> "LoopState":
        """Return the state in which the problem of a robot's state and an intent is built."""
        margins = self.margins
        if margins.unknown:
            margins = margins.seen(self.surroundings.collision.values(state.q[None, :])[0])
        return replace(self, margins=margins, predict=after(self.predict, intent))

    def elapsed(self, time: float) -> float:
        """Return how long ago the last command was sent [s]; 0 before the first."""
        return 0.0 if self.last is None else self.last.elapsed(time)

    def guess(self, time: float, horizon: int, size: int) -> FloatArray:
        """Return the accelerations that the robot follows from a time on, (N, n): the warm start."""
        if self.last is None:
            return np.zeros((horizon, size))
        command = self.last.command
        followed = command.trajectory if self.plan is None else Trajectory(self.plan.v, command.dt)
        return followed.accelerations(horizon, self.last.elapsed(time))

"""The shell of every controller that looks at this moment only: checks, limits, diagnostics."""

import math
from collections.abc import Callable
from time import perf_counter

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray, are_finite
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.errors import SOLVER_ERRORS, HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command, Diagnostics, Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import DEAD_MAN_TIME, Intent, closed
from handrail.controllers.interface.validation import InputHistory, InputValidator
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle
from handrail.controllers.safety.limiter import Limiter
from handrail.controllers.typed import Positive, check

Ask = Callable[[State, Intent, FloatArray], FloatArray]
"""State, intent, velocity commanded last (n,) → velocity wanted (n,) [m/s, rad/s].

Raises one of `SOLVER_ERRORS` where there is none.
"""


class ReactiveController:
    """Sends what `ask` wants, clipped to position, velocity and acceleration limits; a controller.

    Brakes when an input is invalid or stale, and when channels are commanded that `ask` does not understand.
    Distances are measured and reported, not kept.

    Args:
        model: of the robot.
        ask: the velocity wanted.
        period: time in which a velocity is reached, one control period [s].
        understood: channels that may be commanded, (m,); all of them when None.
        margins: that `ask` keeps: between shapes, and between tool shapes and work surfaces [m].

    Attributes:
        channels: the robot's command channels.
        surroundings: what stands around.
        slack: by how much `ask` could not keep what it keeps, at the last update.
        distances: of all pairs then, if `ask` has measured them, (P,) [m].
    """

    def __init__(
        self,
        model: RobotModel,
        ask: Ask,
        period: float = 0.05,
        understood: BoolArray | None = None,
        margins: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self.channels = Channels.of(model.description)
        self._model = model
        self._ask = ask
        self._limiter = Limiter(model.description)
        self._validator = InputValidator(self.channels, DEAD_MAN_TIME)
        self._period = check(period, Positive, "control period [s]")
        self._foreign = np.zeros(self.channels.size, dtype=bool) if understood is None else ~understood
        self._margins = margins
        self.reset()

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget when inputs came, and grippers; take the obstacles whose distance is reported."""
        self.surroundings = Surroundings.of(CollisionModel(self._model, obstacles), *self._margins)
        self._inputs = InputHistory()
        self._grippers = (math.nan,) * len(self.channels.hands)
        self._command: Command | None = None  # the last one
        self._time = math.nan  # when that was sent [s]

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now, how fast they move, and what the hand holds."""
        self.surroundings = self.surroundings.among(obstacles)

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from now on; brakes on an input that is invalid or stale."""
        start = perf_counter()
        self.slack = 0.0
        self.distances: FloatArray | None = None
        makes_sense = self.surroundings.make_sense
        status, self._inputs = self._validator.check(state, intent, makes_sense, self._inputs)
        if status is Status.OK and np.any(intent.mask & self._foreign):
            status = Status.INVALID_INTENT
        previous = state.sent(self._model.description.limits, self._followed(state.time))
        target = np.zeros(self._model.size)
        if status is Status.OK:
            self._grippers = closed(intent.grippers, len(self._grippers))
            try:
                target = self._asked(state, intent, previous)
            except SOLVER_ERRORS:
                status = Status.SOLVER_FAILED
        q = state.q if state.is_of(self._model.size) else None
        velocity, clipped = self._limiter.limit(previous, target, self._period, q)
        if status is Status.OK and clipped:
            status = Status.CLIPPED
        velocities = self._limiter.to_rest(np.stack([previous, velocity]), self._period)
        solve_time = perf_counter() - start
        near = (np.inf, np.inf) if q is None else self._smallest(q)
        diagnostics = Diagnostics(status, solve_time, self.slack, *near)
        self._command = Command(velocities, self._period, grippers=self._grippers, diagnostics=diagnostics)
        self._time = state.time
        return self._command

    def _followed(self, time: float) -> FloatArray | None:
        """Return the velocity of the last command at a time, (n,); a period on where that is no later one."""
        passed = time - self._time
        known = 0.0 < passed < math.inf
        return self._command.velocity(passed if known else self._period) if self._command else None

    def _asked(self, state: State, intent: Intent, previous: FloatArray) -> FloatArray:
        """Return the velocity wanted, checked: n finite numbers."""
        target = np.asarray(self._ask(state, intent, previous), np.float64)
        if target.shape != previous.shape or not are_finite(target):
            raise HandrailError(f"velocity wanted: expected {len(previous)} finite numbers, got {target}")
        return target

    def _smallest(self, q: FloatArray) -> tuple[float, float]:
        """Return the smallest distances now [m]; margins of what is held are seen by the way."""
        distances = self.distances
        if distances is None:
            distances = self.surroundings.collision.values(q[None])[0]
        self.surroundings = self.surroundings.seen(distances)
        return self.surroundings.smallest(distances)

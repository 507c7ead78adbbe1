"""The shell of every controller that looks at this moment only: checks, limits, diagnostics."""

from collections.abc import Callable
from time import perf_counter

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command, Diagnostics, Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.validation import InputHistory, InputValidator
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle
from handrail.controllers.safety.limiter import Limiter

Ask = Callable[[State, Intent, FloatArray], FloatArray]
"""State, intent, velocity commanded last (n,) → velocity wanted (n,) [m/s, rad/s]."""


class ReactiveController:
    """Sends what `ask` wants, clipped to position, velocity and acceleration limits; a controller.

    Brakes when an input is invalid or stale, and when channels are commanded that `ask` does not understand.
    Distances are measured and reported, not kept.

    Args:
        model: of the robot.
        ask: the velocity wanted.
        period: time in which a velocity is reached, one control period [s].
        intent_timeout: age from which an intent is stale [s].
        understood: channels that may be commanded, (m,); all of them when None.
    """

    def __init__(
        self,
        model: RobotModel,
        ask: Ask,
        period: float = 0.05,
        intent_timeout: float = 0.25,
        understood: BoolArray | None = None,
    ) -> None:
        self.channels = Channels.of(model.description)
        self._model = model
        self._ask = ask
        self._limiter = Limiter(model.description)
        self._validator = InputValidator(self.channels, intent_timeout)
        self._period = period
        self._foreign = np.zeros(self.channels.size, dtype=bool) if understood is None else ~understood
        self.reset()

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget when inputs came, and the gripper; take the obstacles whose distance is reported."""
        self._surroundings = Surroundings(CollisionModel(self._model, obstacles))
        self._inputs = InputHistory()
        self._gripper = 0.0

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now, and what the hand holds."""
        self._surroundings = self._surroundings.among(obstacles)

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from now on."""
        start = perf_counter()
        makes_sense = self._surroundings.make_sense
        status, self._inputs = self._validator.check(state, intent, makes_sense, self._inputs)
        if status is Status.OK and np.any(intent.mask & self._foreign):
            status = Status.INVALID_INTENT
        previous = state.sent(self._model.description.limits)
        target = np.zeros(self._model.size)
        if status is Status.OK:
            target = self._ask(state, intent, previous)
            self._gripper = min(max(intent.gripper, 0.0), 1.0)
        q = state.q if state.is_of(self._model.size) else None
        velocity, clipped = self._limiter.limit(previous, target, self._period, q)
        if status is Status.OK and clipped:
            status = Status.CLIPPED
        velocities = self._limiter.to_rest(np.stack([previous, velocity]), self._period)
        diagnostics = self._diagnostics(state, status, start)
        return Command(velocities, self._period, self._gripper, diagnostics)

    def _diagnostics(self, state: State, status: Status, start: float) -> Diagnostics:
        solve_time = perf_counter() - start
        if not state.is_of(self._model.size):
            return Diagnostics(status, solve_time)
        collision = self._surroundings.collision
        distances = collision.values(state.q[None, :])[0]
        work = collision.work
        return Diagnostics(
            status=status,
            solve_time=solve_time,
            smallest_distance=float(np.min(distances[~work], initial=np.inf)),
            work_distance=float(np.min(distances[work], initial=np.inf)),
        )

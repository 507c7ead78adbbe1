"""The shell of every controller that looks at this moment only: checks, limits, health."""

from collections.abc import Callable
from time import perf_counter

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.channels import Channels
from handrail.controllers.collision import CollisionModel
from handrail.controllers.command import Command, Health, Status
from handrail.controllers.controller import State
from handrail.controllers.guard import check_inputs
from handrail.controllers.intent import Intent
from handrail.controllers.limiter import Limiter
from handrail.controllers.model import RobotModel
from handrail.controllers.shape import Obstacle

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
        self._period = period
        self._timeout = intent_timeout
        self._foreign = np.zeros(self.channels.size, dtype=bool) if understood is None else ~understood
        self.reset()

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the last command; take the obstacles whose distance is reported."""
        self._collision = CollisionModel(self._model, obstacles)
        self._previous: FloatArray | None = None
        self._gripper = 0.0

    def observe(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now, and what the hand holds."""
        self._collision = self._collision.among(obstacles)

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from now on."""
        start = perf_counter()
        status = check_inputs(state, intent, self.channels, self._timeout)
        if status is Status.OK and np.any(intent.mask & self._foreign):
            status = Status.INVALID_INTENT
        previous = self._start_velocity(state)
        target = np.zeros(self._model.size)
        if status is Status.OK:
            target = self._ask(state, intent, previous)
            self._gripper = float(np.clip(intent.gripper, 0.0, 1.0))
        q = state.q if status is not Status.INVALID_STATE else None
        velocity, clipped = self._limiter.limit(previous, target, self._period, q)
        if status is Status.OK and clipped:
            status = Status.CLIPPED
        self._previous = velocity
        health = self._health(state, status, start)
        return Command(np.stack([previous, velocity]), self._period, self._gripper, health)

    def _start_velocity(self, state: State) -> FloatArray:
        if self._previous is not None:
            return self._previous
        valid = state.is_finite and state.v.shape == (self._model.size,)
        return state.v if valid else np.zeros(self._model.size)

    def _health(self, state: State, status: Status, start: float) -> Health:
        solve_time = perf_counter() - start
        if status is Status.INVALID_STATE:
            return Health(status, solve_time)
        distances = self._collision.values(state.q[None, :])[0]
        work = self._collision.work
        return Health(
            status=status,
            solve_time=solve_time,
            smallest_distance=float(np.min(distances[~work], initial=np.inf)),
            work_distance=float(np.min(distances[work], initial=np.inf)),
        )

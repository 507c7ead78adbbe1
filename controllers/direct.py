"""Direct joint teleoperation: the baseline that completes nothing."""

from time import perf_counter

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.channels import Channels
from handrail.controllers.collision import CollisionModel
from handrail.controllers.command import Command, Health, Status
from handrail.controllers.controller import State
from handrail.controllers.guard import check_inputs
from handrail.controllers.intent import Intent
from handrail.controllers.limiter import Limiter
from handrail.controllers.model import RobotModel
from handrail.controllers.shape import Obstacle


class DirectController:
    """Sends the commanded joint velocities, clipped to position, velocity and acceleration limits.

    Joints that nobody commands brake. Distances are measured and reported, not kept.

    Args:
        model: of the robot.
        period: time in which a commanded velocity is reached, one control period [s].
        intent_timeout: age from which an intent is stale [s].
    """

    def __init__(self, model: RobotModel, period: float = 0.05, intent_timeout: float = 0.25) -> None:
        self._model = model
        self._channels = Channels.of(model.description)
        self._limiter = Limiter(model.description)
        self._period = period
        self._timeout = intent_timeout
        self.reset()

    @property
    def channels(self) -> Channels:
        """The robot's command channels."""
        return self._channels

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the last command; take the obstacles whose distance is reported."""
        self._collision = CollisionModel(self._model, obstacles)
        self._previous: FloatArray | None = None
        self._gripper = 0.0

    def observe(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now."""
        self._collision.observe(obstacles)

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from now on; brakes when an input is invalid or stale."""
        start = perf_counter()
        status = check_inputs(state, intent, self._channels, self._timeout)
        previous = self._start_velocity(state)
        target = np.zeros(self._model.size)
        if status is Status.OK:
            joints = self._channels.joint_slice
            target = np.where(intent.mask[joints], intent.values[joints], 0.0)
            self._gripper = float(np.clip(intent.gripper, 0.0, 1.0))
        q = state.q if status is not Status.INVALID_STATE else None
        velocity, clipped = self._limiter.limit(previous, target, self._period, q)
        if status is Status.OK and clipped:
            status = Status.CLIPPED
        self._previous = velocity
        health = self._health(state, status, perf_counter() - start)
        return Command(np.stack([previous, velocity]), self._period, self._gripper, health)

    def _start_velocity(self, state: State) -> FloatArray:
        if self._previous is not None:
            return self._previous
        valid = state.is_finite and state.v.shape == (self._model.size,)
        return state.v if valid else np.zeros(self._model.size)

    def _health(self, state: State, status: Status, solve_time: float) -> Health:
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

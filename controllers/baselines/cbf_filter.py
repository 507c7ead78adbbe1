"""The one-step safety filter with control barrier functions: the classical rival of the predictive one."""

from dataclasses import dataclass, fields, replace
from time import perf_counter

import daqp
import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.margins import Margins
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command, Diagnostics, Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.validation import InputHistory, InputValidator
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle
from handrail.controllers.safety.limiter import Limiter

_INFINITE = 1e30


@dataclass(frozen=True)
class CbfSettings:
    """Settings of the filter.

    Attributes:
        alpha: α, how fast a distance may shrink, relative to what is left above its margin [1/s]. Braking
            from v along `d' = -α (d - margin)` takes `α v`: above a_max / v_max it asks for more than the
            robot has.
        margin: signed distance kept between shapes [m].
        work_margin: the same between tool shapes and work surfaces [m].
        activation_distance: distance beyond the margin at which a pair gets a row [m].
        slack_linear: linear penalty of the slack of the rows, per m/s.
        slack_quadratic: quadratic penalty of it.
        intent_timeout: age from which an intent is stale [s].
    """

    alpha: float = 1.0
    margin: float = 0.10
    work_margin: float = 0.008
    activation_distance: float = 2.0
    slack_linear: float = 1e4
    slack_quadratic: float = 1e4
    intent_timeout: float = 0.25

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            HandrailError: one is negative or not finite.
        """
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not np.isfinite(value) or value < 0:
                raise HandrailError(f"CBF setting {entry.name}: expected a finite number >= 0, got {value}")


@dataclass(frozen=True)
class _Barriers:
    """`gradients u ≥ lower` of the R near pairs, (R, n) and (R,), and the distances of all, (P,)."""

    gradients: FloatArray
    lower: FloatArray
    distances: FloatArray


class CbfFilter:
    """Sends the joint velocities nearest to the commanded ones that the barriers allow; a controller.

    `min ‖u - u_cmd‖²_W + ρ₁ s + ½ ρ₂ s²  s.t.  ∇d·u + ∂d/∂t ≥ -α (d - margin) - s` for every near pair, with
    u within the limits of velocity and acceleration and able to brake before the position limits, and
    W = diag(1 / v_max²). It looks one step ahead: at high speed the acceleration limit can leave it without
    a solution, and then s > 0. Joints that nobody commands are asked to rest.

    Args:
        model: of the robot.
        period: time in which a velocity is reached, one control period [s].
        settings: α, margins.
    """

    def __init__(self, model: RobotModel, period: float = 0.05, settings: CbfSettings | None = None) -> None:
        self._model = model
        self._period = period
        self._settings = settings or CbfSettings()
        self.channels = Channels.of(model.description)
        self._validator = InputValidator(self.channels, self._settings.intent_timeout)
        self._limiter = Limiter(model.description)
        self._weights = model.description.limits.velocity**-2.0
        self.reset()

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the past; take the obstacles of a new episode."""
        self._surroundings = Surroundings(CollisionModel(self._model, obstacles))
        self._margins = self._wanted_margins()
        self._inputs = InputHistory()
        self._gripper = 0.0

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now, how fast they move, and what the hand holds."""
        before, self._surroundings = self._surroundings, self._surroundings.among(obstacles)
        if self._surroundings.collision is not before.collision:
            self._margins = self._wanted_margins(self._margins)

    def _wanted_margins(self, before: Margins | None = None) -> Margins:
        """Return the margins of the pairs that there are now."""
        settings = self._settings
        return Margins.of(self._surroundings.collision, settings.margin, settings.work_margin, before)

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from now on; brakes on a bad input or a failed solve."""
        start = perf_counter()
        makes_sense = self._surroundings.make_sense
        status, self._inputs = self._validator.check(state, intent, makes_sense, self._inputs)
        previous = state.sent(self._model.description.limits)
        if state.is_of(self._model.size):
            velocity, diagnostics = self._filtered(state.q, previous, intent, status)
        else:
            velocity, _ = self._limiter.limit(previous, np.zeros(self._model.size), self._period)
            diagnostics = Diagnostics(status)
        velocities = self._limiter.to_rest(np.stack([previous, velocity]), self._period)
        diagnostics = replace(diagnostics, solve_time=perf_counter() - start)
        return Command(velocities, self._period, self._gripper, diagnostics)

    def _filtered(
        self, q: FloatArray, previous: FloatArray, intent: Intent, status: Status
    ) -> tuple[FloatArray, Diagnostics]:
        """Return the velocity to command, (n,), and the diagnostics but for its time."""
        barriers = self._barriers(q)
        asked, wanted, slack = np.zeros(self._model.size), np.zeros(self._model.size), 0.0
        if status is Status.OK:
            self._gripper = float(np.clip(intent.gripper, 0.0, 1.0))
            joints = self.channels.joint_slice
            fastest = self._model.description.limits.velocity
            asked = np.clip(np.where(intent.mask[joints], intent.values[joints], 0.0), -fastest, fastest)
            wanted, slack, solved = self._solve(asked, barriers, *self._bounds(previous, q))
            status = Status.OK if solved else Status.SOLVER_FAILED
        velocity, _ = self._limiter.limit(previous, wanted, self._period, q)
        work = self._surroundings.collision.work
        return velocity, Diagnostics(
            status=status,
            slack=slack,
            smallest_distance=float(np.min(barriers.distances[~work], initial=np.inf)),
            work_distance=float(np.min(barriers.distances[work], initial=np.inf)),
            tracking_error=float(np.linalg.norm(velocity - asked)),
        )

    def _barriers(self, q: FloatArray) -> _Barriers:
        """Return the barrier rows at q; how the obstacles' own motion changes d is seen over a period."""
        collision = self._surroundings.collision
        if self._margins.unknown:
            self._margins = self._margins.seen(collision.values(q[None, :])[0])
        times = np.array([0.0, self._period])
        within = self._margins.values + self._settings.activation_distance
        distances = collision.distances(np.stack([q, q]), within, times)
        self._margins = self._margins.seen(distances.values[0])
        keep = distances.near[:, 0] == 1
        pair = distances.near[keep, 1]
        now, then = distances.values[:, pair]
        drift = (then - now) / self._period
        lower = -self._settings.alpha * (now - self._margins.values[pair]) - drift
        return _Barriers(distances.gradients[keep], lower, distances.values[0])

    def _bounds(self, previous: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what velocities the limits allow, (n,) each."""
        fastest = self._model.description.limits.velocity
        slowest, _ = self._limiter.limit(previous, -fastest, self._period, q)
        return slowest, self._limiter.limit(previous, fastest, self._period, q)[0]

    def _solve(
        self, asked: FloatArray, barriers: _Barriers, lower: FloatArray, upper: FloatArray
    ) -> tuple[FloatArray, float, bool]:
        """Return the nearest velocity that is allowed, (n,), the slack [m/s], and whether that succeeded."""
        hessian = np.diag(np.append(self._weights, self._settings.slack_quadratic))
        gradient = np.append(-self._weights * asked, self._settings.slack_linear)
        matrix = np.hstack([barriers.gradients, np.ones((len(barriers.lower), 1))])
        above = np.concatenate([upper, np.full(len(matrix) + 1, _INFINITE)])
        below = np.concatenate([lower, [0.0], barriers.lower])
        solution, _, flag, _ = daqp.solve(hessian, gradient, matrix, above, below)
        if flag <= 0 or not np.isfinite(solution).all():
            return np.zeros(len(asked)), 0.0, False
        return solution[:-1], max(float(solution[-1]), 0.0), True

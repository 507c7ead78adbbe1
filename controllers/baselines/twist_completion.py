"""Completions: rules that turn a twist of the tool into a whole-body velocity, without looking ahead."""

from collections.abc import Callable

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.reactive import ReactiveController
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import Pose, RobotModel, joints_of

Completion = Callable[[FloatArray, FloatArray, FloatArray, float], FloatArray]
"""q (n,), velocity commanded last (n,), twist (6,), period [s] → velocity wanted (n,) [m/s, rad/s].

The twist is (v, ω), world-aligned at the tool point.
"""


class WholeBodyCompletion:
    """Damped least squares, `v = argmin ‖L (J v − twist)‖² + λ ‖W v‖²`, `W = diag(1 / v_max)`; a completion.

    Args:
        model: of the robot.
        weights: the diagonal of λ W², (n,); by default λ is 0.01.
        length: that weighs as much as one radian [m]: L divides the translation by it.
    """

    def __init__(self, model: RobotModel, weights: FloatArray | None = None, length: float = 1.0) -> None:
        self._model, self._rows = model, np.repeat([1.0 / length, 1.0], 3)
        usual = model.description.limits.velocity**2 / 0.01
        self._inverse = usual if weights is None else 1.0 / weights  # of λ W², (n,)

    def __call__(self, q: FloatArray, previous: FloatArray, twist: FloatArray, duration: float) -> FloatArray:
        """Return the velocity, (n,)."""
        matrix = self._rows[:, None] * self._model.jacobian(q)
        return damped_least_squares(matrix, self._rows * twist, self._inverse)


def damped_least_squares(matrix: FloatArray, values: FloatArray, inverse: FloatArray) -> FloatArray:
    """Return `v = argmin ‖A v − b‖² + vᵀ D⁻¹ v = D Aᵀ (A D Aᵀ + I)⁻¹ b`, (n,).

    Args:
        matrix: A, (c, n).
        values: b, (c,).
        inverse: the diagonal of D, (n,).
    """
    scaled = inverse[:, None] * matrix.T
    return scaled @ np.linalg.solve(matrix @ scaled + np.eye(len(values)), values)


class TwistController(ReactiveController):
    """Completes the tool's twist by a rule; other channels make it brake; a controller.

    Axes of the tool that nobody commands are kept still; with none commanded the robot rests.

    Args:
        model: of the robot.
        complete: the rule.
        period: of the control loop [s].
        margins: that the rule keeps, as of `ReactiveController` [m].
    """

    def __init__(
        self,
        model: RobotModel,
        complete: Completion,
        period: float = 0.05,
        margins: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self._complete = complete
        understood = Channels.of(model.description).mask(model.hand.name or "ee")
        super().__init__(model, self._completed, period, understood, margins)

    def _completed(self, state: State, intent: Intent, previous: FloatArray) -> FloatArray:
        if not intent.mask.any():
            return np.zeros(self._model.size)
        twist = tool_twist(intent, self.channels, self._model.pose(state.q), self._model.number)
        return self._complete(state.q, previous, twist, self._period)


def least_squares_controller(model: RobotModel, period: float = 0.05) -> TwistController:
    """Return the controller of the hand alone: `WholeBodyCompletion`, clipped as `DirectController` clips.

    It looks neither ahead nor at obstacles.

    Args:
        model: of the robot.
        period: of the control loop [s].
    """
    return TwistController(model, WholeBodyCompletion(model), period)


def base_first_controller(model: RobotModel, period: float = 0.05) -> TwistController:
    """Return `least_squares_controller` with the masked MPC's own weights: it moves the base before the arm.

    Args:
        model: of the robot.
        period: of the control loop [s].
    """
    settings = MpcSettings.of(model.description.world.scale)
    arm = np.arange(model.size) >= len(model.description.base.joints)
    weights = np.where(arm, settings.arm_velocity, settings.base_velocity) / settings.tracking
    weights /= np.where([joint.prismatic for joint in joints_of(model)], settings.length**2, 1.0)
    return TwistController(model, WholeBodyCompletion(model, weights=weights, length=settings.length), period)


def base_velocity(intent: Intent, channels: Channels, q: FloatArray) -> FloatArray:
    """Return the commanded base twist as the base's joint velocities in the world, (3,), or (0,)."""
    if not channels.base:
        return np.zeros(0)
    twist = np.where(intent.mask, intent.values, 0.0)[channels.base_slice]
    return twist if intent.frames.base == "world" else turned(twist, q[2])


def tool_twist(intent: Intent, channels: Channels, tool: Pose, hand: int = 0) -> FloatArray:
    """Return the commanded twist (v, ω), world-aligned at the tool point of the robot, (6,) [m/s, rad/s].

    A twist in the tool frame is turned by R; one for a point p of the tool loses `ω × R p`.

    Args:
        intent: whose frames say what its twist means.
        channels: of the robot.
        tool: its pose.
        hand: whose it is.
    """
    twist = np.where(intent.mask, intent.values, 0.0)[channels.hand_slice(hand)]
    if intent.frames.tool == "tool":
        twist = np.concatenate([tool.rotation @ twist[:3], tool.rotation @ twist[3:]])
    if intent.frames.point.any():
        twist[:3] -= np.cross(twist[3:], tool.rotation @ intent.frames.point)
    return twist

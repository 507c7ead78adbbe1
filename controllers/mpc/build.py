"""Builds the masked optimal control problem of a state and an intent."""

from functools import lru_cache

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.loop_state import LoopState
from handrail.controllers.ocp.motion import cut, resumed
from handrail.controllers.ocp.problem import Problem
from handrail.controllers.ocp.residuals import StageResiduals
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import RobotModel

_MASKS = 1024  # whose weights are remembered


class ProblemBuilder:
    """Asks what the problem is; the answer depends on nothing but the question.

    Args:
        model: of the robot.
        settings: weights, margins, horizon.
        residuals: of all objectives.
    """

    def __init__(self, model: RobotModel, settings: MpcSettings, residuals: StageResiduals) -> None:
        self._limits = model.description.limits
        self._settings, self._residuals = settings, residuals
        self._size, self._channels = model.size, Channels.of(model.description)
        self._times = settings.dt * np.arange(1, settings.horizon + 1)
        self._tolerance = settings.velocity_tolerance * self._limits.velocity
        self._reference = np.tile(residuals.reference, (settings.horizon, 1))
        self._largest = self._largest_intent()
        self._weights_of = lru_cache(_MASKS)(self._weights)

    def build(self, loop: LoopState, state: State, intent: Intent) -> Problem:
        """Return the optimal control problem of a state and an intent, which a loop is facing."""
        settings = self._settings
        reference, parameters = self._reference.copy(), loop.parameters.copy()
        predicted = np.asarray(loop.predict(intent, self._times), dtype=np.float64)
        cut(predicted, intent.mask, self._largest, reference)
        parameters[self._residuals.parameter_slice("tracking")] = intent.frames.parameters
        limit = self._limits.velocity
        return Problem(
            q=state.q,
            v=resumed(state.sent(self._limits), state.v, self._tolerance, limit),
            dt=settings.dt,
            reference=reference,
            weights=self._weights_of(intent.mask.tobytes()),
            parameters=parameters,
            channels=self._channels.size,
            limits=self._limits,
            collision=loop.surroundings.collision,
            margins=loop.margins.values,
            activation_distance=settings.activation_distance,
            slack_linear=settings.slack_linear,
            slack_quadratic=settings.slack_quadratic,
        )

    def _largest_intent(self) -> FloatArray:
        """Return what a command of each channel is cut to, (m,): nothing faster is possible, or wise."""
        velocity = self._limits.velocity
        tool = [self._settings.largest_speed] * 3 + [self._settings.largest_rate] * 3
        return np.concatenate([velocity[: len(self._channels.base)], tool, velocity])

    def _weights(self, mask: bytes) -> FloatArray:
        """Return the weights of all rows under a mask's bytes, (N, r)."""
        settings, size = self._settings, self._channels.size
        owned = np.frombuffer(mask, dtype=bool)
        weights = np.tile(self._residuals.weights(owned), (settings.horizon, 1))
        weights[:, :size] *= settings.discounts[:, None]
        velocity = slice(size, size + self._size)
        weights[-1, velocity] += settings.terminal_velocity * (weights[-1, velocity] > 0)
        return weights

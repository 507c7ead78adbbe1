"""Builds the masked optimal control problem of a state and an intent."""

from functools import lru_cache

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.sources import Intents
from handrail.controllers.mpc.loop_state import LoopState
from handrail.controllers.objectives.objective import Objective
from handrail.controllers.objectives.regularisation import (
    acceleration_regularisation,
    posture,
    velocity_regularisation,
)
from handrail.controllers.objectives.tracking import tracking
from handrail.controllers.ocp.problem import Problem
from handrail.controllers.ocp.residuals import StageResiduals
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import RobotModel, joints_of

_MASKS = 1024  # whose weights are remembered


class ProblemBuilder:
    """Asks what the problem is; the answer depends on nothing but the question.

    Args:
        model: of the robot.
        settings: weights, margins, horizon.
        residuals: of all objectives.

    Attributes:
        largest: what a command of each channel is cut to, (m,).
    """

    def __init__(self, model: RobotModel, settings: MpcSettings, residuals: StageResiduals) -> None:
        self._limits = model.description.limits
        self._settings, self._residuals = settings, residuals
        self._size, self._channels = model.size, Channels.of(model.description)
        self._times = settings.dt * np.arange(1, settings.horizon + 1)
        self._tolerance = settings.velocity_tolerance * self._limits.velocity
        self._reference = np.tile(residuals.reference, (settings.horizon, 1))
        base, hands = len(self._channels.base), self._channels.names[self._channels.hands_slice]
        fastest = np.where(_lengths(model, self._channels), settings.largest_speed, settings.largest_rate)
        velocity, fastest = self._limits.velocity, fastest[base : base + len(hands)]
        # nothing faster is possible, or wise
        self.largest = np.concatenate([velocity[:base], fastest, velocity])
        self._home, start = model.description.home, self._channels.size + 2 * model.size
        self._posture = slice(start, start + model.size)
        self._weights_of = lru_cache(_MASKS)(self._weights)

    def build(self, loop: LoopState, state: State, intent: Intent) -> Problem:
        """Return the optimal control problem of a state and an intent, which a loop is facing."""
        settings = self._settings
        parameters = loop.parameters.copy()
        predicted = np.asarray(loop.predict(intent, self._times), dtype=np.float64)
        expected = len(self._times), self._channels.size
        if predicted.shape != expected:
            raise HandrailError(f"prediction: expected values of shape {expected}, got {predicted.shape}")
        reference = _asked(self._reference, predicted, intent.mask, self.largest)
        parameters[self._residuals.parameter_slice("tracking")] = intent.frames.parameters
        if loop.rest is not None:
            reference[:, self._posture] = np.where(np.isnan(loop.rest), self._home, loop.rest)
        weights = self._weights_of(intent.mask.tobytes())
        if isinstance(intent, Intents) and intent.share is not None:
            weights = weights.copy()
            weights[:, : self._channels.size] *= intent.share
        sent = state.sent(self._limits)
        return Problem(
            q=state.expected,
            v=resumed(sent, state.v, self._tolerance),
            sent=sent,
            dt=settings.dt,
            reference=reference,
            weights=weights,
            parameters=parameters,
            limits=self._limits,
            collision=loop.surroundings.collision,
            margins=loop.surroundings.margins,
            activation_distance=settings.activation_distance,
            slack_linear=settings.slack_linear,
            slack_quadratic=settings.slack_quadratic,
        )

    def _weights(self, mask: bytes) -> FloatArray:
        """Return the weights of all rows under a mask's bytes, (N, r)."""
        settings, size = self._settings, self._channels.size
        owned = np.frombuffer(mask, dtype=bool)
        weights = np.tile(self._residuals.weights(owned), (settings.horizon, 1))
        weights[:, :size] *= settings.discounts[:, None]
        velocity = slice(size, size + self._size)
        weights[-1, velocity] += settings.terminal_velocity * (weights[-1, velocity] > 0)
        return weights


def built_in_objectives(
    model: RobotModel, channels: Channels, settings: MpcSettings
) -> tuple[Objective, ...]:
    """Return the objectives that every masked MPC has: tracking first, then the regularisation."""
    base = len(model.description.base.joints)
    arm = np.arange(model.size) >= base
    velocity = np.where(arm, settings.arm_velocity, settings.base_velocity)
    commanded = np.full(channels.size, settings.tracking)
    lengths = _lengths(model, channels)
    hands = channels.hands_slice
    commanded[hands] = np.where(lengths[hands], settings.tracking, settings.turn_tracking)
    shifts = lengths[channels.joint_slice]
    return (
        tracking(channels, _per_length(commanded, lengths, settings)),
        velocity_regularisation(channels, _per_length(velocity, shifts, settings)),
        acceleration_regularisation(
            _per_length(np.full(model.size, settings.acceleration), shifts, settings)
        ),
        posture(channels, model.description.home, settings.posture * arm),
    )


def _lengths(model: RobotModel, channels: Channels) -> BoolArray:
    """Return which channels are speeds of a translation, (m,)."""
    twists = [name.split(".")[1][0] == "v" for name in channels.names[: channels.joint_slice.start]]
    return np.array([*twists, *(joint.prismatic for joint in joints_of(model))])


def _per_length(weights: FloatArray, lengths: BoolArray, settings: MpcSettings) -> FloatArray:
    """Return the weights of rows, those of translations over the square of what weighs as a radian."""
    return np.where(lengths, weights / settings.length**2, weights)


def resumed(commanded: FloatArray, measured: FloatArray, tolerance: FloatArray) -> FloatArray:
    """Return the velocity from which a command goes on, (n,).

    `min(max(c, v - tolerance), v + tolerance)`, but between rest and c. A robot that cannot follow is waited
    for, the tolerance ahead of it; one that is pushed onward keeps what was commanded; one pushed back is
    asked to rest. So its servos hold against a push.

    Args:
        commanded: c, (n,) [m/s, rad/s].
        measured: v, (n,).
        tolerance: how far they may differ, (n,).
    """
    close = np.minimum(np.maximum(commanded, measured - tolerance), measured + tolerance)
    return np.minimum(np.maximum(close, np.minimum(commanded, 0.0)), np.maximum(commanded, 0.0))


def _asked(reference: FloatArray, predicted: FloatArray, mask: BoolArray, largest: FloatArray) -> FloatArray:
    """Return a reference whose first columns are the masked predicted values within ± largest, 0 elsewhere.

    NaN stays NaN: the solver then fails, and the robot brakes.
    """
    result = reference.copy()
    asked = result[:, : len(mask)]
    np.maximum(predicted, -largest, out=asked, where=mask)
    np.minimum(asked, largest, out=asked)
    return result

"""Intent prediction Ψ: what the operator will ask for over the horizon (the paper's equation 4)."""

from collections import deque
from collections.abc import Callable

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.numerics.jit import copy, exact_jit, jit

Prediction = Callable[[Intent, FloatArray], FloatArray]
"""The intent now and times ahead, (N,) [s] → predicted values on every channel, (N, m).

Any callable will do; one that remembers has a `reset()`, called when an episode begins.
"""


def constant(intent: Intent, times: FloatArray) -> FloatArray:
    """Hold the command, `û(t) = u` (the paper's choice), (N, m)."""
    return np.broadcast_to(intent.values, (len(times), len(intent.values)))


class Extrapolated:
    """Go on with the recent trend, `û(t) = u + s τ (1 - exp(-t / τ))`.

    s is the least-squares slope over the window; it fades with τ, so that the prediction levels off. The
    history begins anew when the mask changes.

    Args:
        window: how far back the trend is taken from [s].
        fade: τ [s].
    """

    def __init__(self, window: float = 0.3, fade: float = 0.2) -> None:
        self._window = window
        self._fade = fade
        self.reset()

    def reset(self) -> None:
        """Forget the history."""
        self._history: deque[Intent] = deque()

    def __call__(self, intent: Intent, times: FloatArray) -> FloatArray:
        """Return the predicted values, (N, m)."""
        self._remember(intent)
        gain = self._fade * (1.0 - np.exp(-times / self._fade))
        return intent.values + gain[:, None] * self._slope()

    def _remember(self, intent: Intent) -> None:
        if self._history and not np.array_equal(self._history[-1].mask, intent.mask):
            self._history.clear()
        self._history.append(intent)
        while self._history[0].time < intent.time - self._window:
            self._history.popleft()

    def _slope(self) -> FloatArray:
        times = np.array([intent.time for intent in self._history])
        values = np.array([np.where(intent.mask, intent.values, 0.0) for intent in self._history])
        centred = times - times.mean()
        spread = float(centred @ centred)
        return centred @ values / spread if spread > 0 else np.zeros(values.shape[1])


class Bounded:
    """Hold the command until the hand would have gone some way, then let it rest.

    `û(t) = u` while `t ≤ min(d / ‖v‖, φ / ‖ω‖)`, then zero on the tool's channels; the first time ahead
    always holds. The bound is a length, not a time: a fast command over a long horizon would else be
    predicted to lead where the robot cannot go, and the plan would slow down for what will not happen.

    Args:
        channels: of the robot.
        distance: d [m].
        angle: φ [rad].
    """

    def __init__(self, channels: Channels, distance: float = 0.4, angle: float = 1.5) -> None:
        self._tool = channels.tool_slice.start
        self._distance, self._angle = distance, angle

    def __call__(self, intent: Intent, times: FloatArray) -> FloatArray:
        """Return the predicted values, (N, m)."""
        return _bounded(intent.values, intent.mask, times, self._tool, self._distance, self._angle)


@jit
def _bounded(values, mask, times, tool, distance, angle):
    speed, rate = 0.0, 0.0
    for axis in range(3):
        if mask[tool + axis]:
            speed += values[tool + axis] ** 2
        if mask[tool + 3 + axis]:
            rate += values[tool + 3 + axis] ** 2
    pace = max(speed**0.5 / distance, rate**0.5 / angle)
    predicted = np.empty((len(times), len(values)))
    for k in range(len(times)):
        copy(values, len(values), predicted[k])
        if times[k] * pace > 1.0 and times[k] > times[0]:
            for axis in range(6):
                predicted[k, tool + axis] = 0.0
    return predicted


class Smoothed:
    """Let the hand take up a command gradually: a low-pass that is known ahead.

    `τ ḟ = u - f` from rest, and with Ψ the prediction it smooths `û(t) = Ψ(t) + exp(-t / τ) (f - u)`, which
    is f itself as long as the command holds. The gain at rest is 1: a hand that follows arrives where the
    command leads, τ later. Steps and tremor become what a heavy arm can follow without effort.

    Args:
        predict: Ψ.
        time_constant: τ, one or one a channel [s].
    """

    def __init__(self, predict: Prediction, time_constant: float | FloatArray) -> None:
        self._predict = predict
        self._time_constant = np.asarray(time_constant, dtype=float)
        self.reset()

    def reset(self) -> None:
        """Begin at rest."""
        self._last: tuple[float, FloatArray, FloatArray] | None = None  # time, command and level
        self._faded = b"", np.zeros(0)
        getattr(self._predict, "reset", lambda: None)()

    def __call__(self, intent: Intent, times: FloatArray) -> FloatArray:
        """Return the predicted values, (N, m)."""
        if self._last is None:
            rest = np.zeros(len(intent.values))
            self._time_constant = self._time_constant + rest
            self._last = intent.time, rest, rest
        time, before, level = self._last
        left = np.exp(-max(intent.time - time, 0.0) / self._time_constant)
        command, level = _taken_up(intent.values, intent.mask, before, level, left)
        self._last = intent.time, command, level
        return self._predict(intent, times) + self._fade(times) * (level - command)

    def _fade(self, times: FloatArray) -> FloatArray:
        """Return `exp(-t / τ)`, remembered for the last times asked for, (N, m)."""
        key = times.tobytes()
        if key != self._faded[0]:
            self._faded = key, np.exp(-times[:, None] / self._time_constant)
        return self._faded[1]


@exact_jit
def _taken_up(values, mask, before, level, left):
    """Return command and level now: what is left of the way to the command before is `left` of it, (m,)."""
    command, now = np.zeros(len(values)), np.zeros(len(values))
    for channel in range(len(values)):
        if mask[channel]:
            command[channel] = values[channel]
            now[channel] = before[channel] + left[channel] * (level[channel] - before[channel])
    return command, now

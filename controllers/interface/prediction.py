"""Intent prediction Ψ: what the operator will ask for over the horizon (the paper's equation 4)."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import DEAD_MAN_TIME, Intent

Prediction = Callable[[Intent, FloatArray], FloatArray]
"""The intent now and times ahead, (N,) [s] → predicted values on every channel, (N, m).

Any callable will do. One that remembers is a value with a method `after(intent)`, which returns the
prediction that has heard an intent too; it is asked at every update, before the prediction is made.
"""


def after(predict: Prediction, intent: Intent) -> Prediction:
    """Return the prediction that has heard an intent; itself if it remembers nothing."""
    remember = getattr(predict, "after", None)
    return predict if remember is None else remember(intent)


def constant(intent: Intent, times: FloatArray) -> FloatArray:
    """Hold the command, `û(t) = u` (the paper's choice), (N, m)."""
    held = np.empty((len(times), len(intent.values)))
    held[:] = intent.values
    return held


@dataclass(frozen=True)
class Extrapolated:
    """Go on with the recent trend, `û(t) = u + s τ (1 - exp(-t / τ))`.

    s is the least-squares slope over the window; it fades with τ, so that the prediction levels off. The
    history begins anew when the mask changes.
    """

    window: float = 0.3  # how far back the trend is taken from [s]
    fade: float = 0.2  # τ [s]
    history: tuple[Intent, ...] = ()  # intents of the window

    def after(self, intent: Intent) -> "Extrapolated":
        """Return the prediction that has heard an intent."""
        same = self.history and np.array_equal(self.history[-1].mask, intent.mask)
        before = self.history if same else ()
        recent = (each for each in before if each.time >= intent.time - self.window)
        return replace(self, history=(*recent, intent))

    def __call__(self, intent: Intent, times: FloatArray) -> FloatArray:
        """Return the predicted values, (N, m)."""
        if not self.history:
            return constant(intent, times)
        gain = self.fade * (1.0 - np.exp(-times / self.fade))
        return intent.values + gain[:, None] * self._slope()

    def _slope(self) -> FloatArray:
        times = np.array([intent.time for intent in self.history])
        values = np.array([np.where(intent.mask, intent.values, 0.0) for intent in self.history])
        centred = times - times.mean()
        spread = float(centred @ centred)
        return centred @ values / spread if spread > 0 else np.zeros(values.shape[1])


class Bounded:
    """Hold the command until the hand would have gone some way, then let it rest.

    `û(t) = u` while `t ≤ min(d / ‖v‖, φ / ‖ω‖)`, then zero on the hand's channels; the first time ahead
    always holds. The bound is a length, not a time: a fast command over a long horizon would else be
    predicted to lead where the robot cannot go, and the plan would slow down for what will not happen.

    Args:
        channels: of the robot.
        distance: d [m].
        angle: φ [rad].
    """

    def __init__(self, channels: Channels, distance: float = 0.4, angle: float = 1.5) -> None:
        hands = [channels.hand_slice(hand) for hand in range(len(channels.hands))]
        self._twists = [*hands, *([channels.pair_slice] if channels.pair else [])]
        self._distance, self._angle = distance, angle

    def __call__(self, intent: Intent, times: FloatArray) -> FloatArray:
        """Return the predicted values, (N, m)."""
        predicted = np.tile(intent.values, (len(times), 1))
        for where in self._twists:
            twist = np.where(intent.mask, intent.values, 0.0)[where]
            speed, rate = np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:6])
            pace = max(speed / self._distance, rate / self._angle)
            predicted[(times * pace > 1.0) & (times > times[0]), where] = 0.0
        return predicted


@dataclass(frozen=True)
class Level:
    """The memory of a low-pass: when an intent came last [s], its command and the level then, (m,)."""

    time: float
    command: FloatArray
    level: FloatArray


@dataclass(frozen=True)
class Smoothed:
    """Let the hand take up a command gradually: a low-pass that is known ahead.

    `τ ḟ = u - f` from rest, and with Ψ the prediction it smooths `û(t) = Ψ(t) + exp(-t / τ) (f - u)`, which
    is f itself as long as the command holds. The gain at rest is 1: a hand that follows arrives where the
    command leads, τ later. Steps and tremor become what a heavy arm can follow without effort.
    """

    predict: Prediction  # Ψ
    time_constant: float | FloatArray  # τ, one or one a channel [s]
    last: Level | None = None  # command and level now; None at rest, before the first intent
    silence: float = DEAD_MAN_TIME
    """Time without an intent after which it begins from rest, as the robot has braked [s]."""

    def after(self, intent: Intent) -> "Smoothed":
        """Return the prediction that has heard an intent."""
        rest = np.zeros(len(intent.values))
        last = self.last
        if last is None or intent.time - last.time > self.silence:
            last = Level(intent.time, rest, rest)
        left = np.exp(-max(intent.time - last.time, 0.0) / (self.time_constant + rest))
        command = np.where(intent.mask, intent.values, 0.0)
        level = np.where(intent.mask, last.command + left * (last.level - last.command), 0.0)
        return replace(self, predict=after(self.predict, intent), last=Level(intent.time, command, level))

    def __call__(self, intent: Intent, times: FloatArray) -> FloatArray:
        """Return the predicted values, (N, m)."""
        if self.last is None:
            return self.after(intent)(intent, times)
        faded = np.exp(-times[:, None] / (self.time_constant + np.zeros(len(intent.values))))
        return self.predict(intent, times) + faded * (self.last.level - self.last.command)

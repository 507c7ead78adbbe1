"""The human-like hand: delay, intermittency, signal-dependent noise, drift."""

from collections import deque
from dataclasses import dataclass, fields

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError


@dataclass(frozen=True)
class HumanSettings:
    """How human the operator's hand is; all zero is a perfect hand.

    Attributes:
        delay: from perception to hand [s]; 0.14–0.25 in people.
        refractory: shortest time between two corrections [s]; 0.35 for a velocity stick.
        threshold: change of the wanted command, relative to full stick, below which the hand stays.
        noise: standard deviation of the signal-dependent noise over |command|; about 0.1.
        drift: standard deviation of the drift over full stick, while the stick is deflected.
        correlation: how fast noise and drift wander, time constant [s].
        switch_time: hands off the stick while changing the teleop mode [s].
    """

    delay: float = 0.2
    refractory: float = 0.35
    threshold: float = 0.03
    noise: float = 0.1
    drift: float = 0.02
    correlation: float = 0.5
    switch_time: float = 0.4

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            HandrailError: one is negative or not finite.
        """
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not np.isfinite(value) or value < 0:
                raise HandrailError(f"--human.{entry.name}: expected a finite number >= 0, got {value}")

    @classmethod
    def perfect(cls) -> "HumanSettings":
        """Return a hand without delay, noise or drift."""
        return cls(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    def scaled(self, factor: float) -> "HumanSettings":
        """Return the settings with everything but the correlation time multiplied by a factor."""
        values = {entry.name: getattr(self, entry.name) * factor for entry in fields(self)}
        return HumanSettings(**values | {"correlation": self.correlation})


class HumanHand:
    """Turns the wanted command of each moment into what the hand does.

    The hand sees `wanted(t - delay)`; it moves to it only when that differs from what it holds by more
    than the threshold and the refractory time has passed (intermittent control), or at once when it is
    let go. On what it holds come `noise · |held| · a` and `drift · full · b`, where a and b are
    Ornstein–Uhlenbeck processes of unit variance.

    Args:
        settings: of the hand.
        full: full deflection of every input, (k,).
    """

    def __init__(self, settings: HumanSettings, full: FloatArray) -> None:
        self._settings = settings
        self._full = np.asarray(full, dtype=float)

    def reset(self, rng: np.random.Generator) -> None:
        """Begin an episode with the hand at rest."""
        size = len(self._full)
        self._rng = rng
        self._seen: deque[tuple[float, FloatArray]] = deque()
        self._held = np.zeros(size)
        self._moved = -np.inf
        self._time: float | None = None
        self._wander = rng.standard_normal((2, size))

    def move(self, wanted: FloatArray, time: float) -> FloatArray:
        """Return what the hand commands at a time [s], given what the operator wants now, (k,)."""
        self._hold(self._delayed(wanted, time), time)
        noise, drift = self._step_wander(time)
        settings = self._settings
        touched = np.abs(self._held) > 0
        moved = (
            self._held
            + settings.noise * np.abs(self._held) * noise
            + settings.drift * self._full * drift * touched
        )
        return np.clip(moved, -self._full, self._full) if settings.noise or settings.drift else moved

    def _delayed(self, wanted: FloatArray, time: float) -> FloatArray:
        self._seen.append((time, np.array(wanted, dtype=float)))
        while len(self._seen) > 1 and self._seen[1][0] <= time - self._settings.delay + 1e-9:
            self._seen.popleft()
        oldest, values = self._seen[0]
        return values if oldest <= time - self._settings.delay + 1e-9 else np.zeros_like(self._full)

    def _hold(self, wanted: FloatArray, time: float) -> None:
        change = np.max(np.abs(wanted - self._held) / self._full)
        released = not np.any(wanted)
        rested = time - self._moved >= self._settings.refractory - 1e-9
        if released or (change > self._settings.threshold and rested) or not self._settings.refractory:
            self._moved = self._moved if np.array_equal(wanted, self._held) else time
            self._held = wanted

    def _step_wander(self, time: float) -> FloatArray:
        if self._time is not None and self._settings.correlation > 0:
            keep = np.exp(-(time - self._time) / self._settings.correlation)
            fresh = self._rng.standard_normal(self._wander.shape)
            self._wander = keep * self._wander + np.sqrt(1.0 - keep**2) * fresh
        self._time = time
        return self._wander

"""The human-like hand: delay, intermittency, minimum-jerk movements, signal-dependent noise, drift."""

from collections import deque

import numpy as np

from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.wander import Wander
from handrail.controllers.arrays import FloatArray


class HumanHand:
    """Turns the wanted command of each moment into what the hand does.

    The hand sees `wanted(t - delay)`; it moves there only when that differs from where it is going by more
    than `threshold · fine` and the refractory time has passed (intermittent control), or at once when it is
    let go. It moves along minimum jerk, `10τ³ - 15τ⁴ + 6τ⁵` of the way. On where it is come
    `noise · |held| · a` and `drift · fine · b`, where a and b are Ornstein–Uhlenbeck processes.

    Args:
        settings: of the hand.
        full: full deflection of every input, (k,).
        fine: what dead zone and drift are shares of, (k,).
        rng: of the episode, which begins with the hand at rest.
    """

    def __init__(
        self, settings: HumanSettings, full: FloatArray, fine: FloatArray, rng: np.random.Generator
    ) -> None:
        self._settings = settings
        self._full, self._fine = np.asarray(full, dtype=float), np.asarray(fine, dtype=float)
        self._seen: deque[tuple[float, FloatArray]] = deque()
        self._left = np.zeros(len(self._full))  # where the last movement began
        self._held = np.zeros(len(self._full))  # where it ends
        self._moved = -np.inf
        self._wander = Wander((2, len(self._full)), settings.correlation, rng)

    def move(self, wanted: FloatArray, time: float) -> FloatArray:
        """Return what the hand commands at a time [s], given what the operator wants now, (k,)."""
        self._correct(self._delayed(wanted, time), time)
        noise, drift = self._wander.at(time)
        settings, held = self._settings, self._position(time)
        touched = np.abs(held) > 0
        moved = held + settings.noise * np.abs(held) * noise + settings.drift * self._fine * drift * touched
        return np.clip(moved, -self._full, self._full) if settings.noise or settings.drift else moved

    def _delayed(self, wanted: FloatArray, time: float) -> FloatArray:
        self._seen.append((time, np.array(wanted, dtype=float)))
        while len(self._seen) > 1 and self._seen[1][0] <= time - self._settings.delay + 1e-9:
            self._seen.popleft()
        oldest, values = self._seen[0]
        return values if oldest <= time - self._settings.delay + 1e-9 else np.zeros_like(self._full)

    def _correct(self, wanted: FloatArray, time: float) -> None:
        """Begin a movement if there is reason to, and it may begin."""
        change = np.max(np.abs(wanted - self._held) / self._fine)
        released = not np.any(wanted)
        rested = time - self._moved >= self._settings.refractory - 1e-9
        begins = released or (change > self._settings.threshold and rested) or not self._settings.refractory
        if begins and not np.array_equal(wanted, self._held):
            self._left = np.zeros_like(self._held) if released else self._position(time)
            self._held, self._moved = wanted, time

    def _position(self, time: float) -> FloatArray:
        """Return where the hand is on its way, without noise, (k,)."""
        if not np.isfinite(self._moved) or not self._settings.movement:
            return self._held
        return self._left + minimum_jerk((time - self._moved) / self._settings.movement) * (
            self._held - self._left
        )


def minimum_jerk(share: float) -> float:
    """Return how far a minimum-jerk movement is after a share of its time: `10τ³ - 15τ⁴ + 6τ⁵`."""
    tau = min(max(share, 0.0), 1.0)
    return tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)

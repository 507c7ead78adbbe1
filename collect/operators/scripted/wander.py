"""Ornstein–Uhlenbeck processes: what wanders about zero in a person."""

import numpy as np

from handrail.controllers.arrays import FloatArray


class Wander:
    """Independent processes of unit variance: `x(t + h) = e^{−h/τ} x(t) + √(1 − e^{−2h/τ}) ξ`.

    Args:
        shape: of x.
        correlation: time constant τ [s]; 0 stands still.
        rng: drawn from.
    """

    def __init__(self, shape: tuple[int, ...], correlation: float, rng: np.random.Generator) -> None:
        self._correlation = correlation
        self._rng = rng
        self._value = rng.standard_normal(shape)
        self._time: float | None = None

    def at(self, time: float) -> FloatArray:
        """Return x at a time that is not before the last one [s]."""
        if self._time is not None and self._correlation > 0:
            keep = np.exp(-(time - self._time) / self._correlation)
            fresh = self._rng.standard_normal(self._value.shape)
            self._value = keep * self._value + np.sqrt(1.0 - keep**2) * fresh
        self._time = time
        return self._value

"""Measures of a motion: how smooth it was, and how far it went.

Definitions and golden values: Balasubramanian et al. 2015, "On the analysis of movement smoothness".
"""

import numpy as np

from handrail.controllers.errors import HandrailError

CUTOFF = 10.0  # [Hz]
AMPLITUDE_THRESHOLD = 0.05
ZERO_PADDING = 4  # powers of two


def sparc(speed: np.ndarray, fs: float) -> float:
    """Return the spectral arc length: 0 is smoothest, more negative is less smooth.

    −∫₀^ωc √((1/ωc)² + (dV̂/dω)²) dω, where V̂ is the amplitude spectrum over its value at its peak and ωc the
    highest frequency up to 10 Hz at which V̂ ≥ 0.05. Independent of duration and scale.

    Args:
        speed: Speed, `(N,)`, in any unit.
        fs: Samples a second [Hz].

    Returns:
        The measure (minimum jerk: about −1.4), or NaN if nothing moves or there are fewer than two samples.

    Raises:
        HandrailError: `speed` is no vector, or `fs` is not positive.
    """
    speed = _checked(speed, fs)
    if not _moves(speed):
        return float("nan")
    size = 2 ** (int(np.ceil(np.log2(len(speed)))) + ZERO_PADDING)
    spectrum = np.abs(np.fft.fft(speed, size))
    frequency = np.arange(size) * fs / size
    low = frequency <= CUTOFF
    amplitude, frequency = spectrum[low] / spectrum.max(), frequency[low]
    above = np.flatnonzero(amplitude >= AMPLITUDE_THRESHOLD)
    if not above.size or above[0] == above[-1]:
        return float("nan")
    band = slice(above[0], above[-1] + 1)
    width = frequency[band][-1] - frequency[band][0]
    return -float(np.hypot(np.diff(frequency[band]) / width, np.diff(amplitude[band])).sum())


def ldlj(speed: np.ndarray, fs: float) -> float:
    """Return the log dimensionless jerk: higher is smoother.

    −ln[(T³ / v_peak²) ∫ (d²v/dt²)² dt]. Very sensitive to noise: use a simulator's velocity, or SPARC.

    Args:
        speed: Speed, `(N,)`, in any unit.
        fs: Samples a second [Hz].

    Returns:
        The measure (minimum jerk: about −5.2), or NaN if nothing moves or there are fewer than three samples.

    Raises:
        HandrailError: `speed` is no vector, or `fs` is not positive.
    """
    speed = _checked(speed, fs)
    jerk = np.diff(speed, 2) * fs**2
    if not _moves(speed) or not jerk.any():
        return float("nan")
    duration, peak = len(speed) / fs, np.abs(speed).max()
    return -float(np.log(duration**3 / peak**2 * (jerk @ jerk) / fs))


def path_length(positions: np.ndarray) -> float:
    """Return how far a point travelled.

    Args:
        positions: `(N, d)` [m].

    Returns:
        The length of the path [m].
    """
    return float(np.linalg.norm(np.diff(np.asarray(positions, float), axis=0), axis=1).sum())


def _checked(speed: np.ndarray, fs: float) -> np.ndarray:
    speed = np.asarray(speed, float)
    if speed.ndim != 1:
        raise HandrailError(f"speed: expected the shape (N,), got {speed.shape}")
    if not fs > 0:
        raise HandrailError(f"fs: expected a positive rate [Hz], got {fs}")
    return speed


def _moves(speed: np.ndarray) -> bool:
    return len(speed) > 1 and bool(np.isfinite(speed).all()) and bool(speed.any())

"""Measures of a motion: how smooth it was, how far it went, and how much a safety filter chattered.

Smoothness, definitions and golden values: Balasubramanian et al. 2015, "On the analysis of movement
smoothness". Chattering: Pizarro Bejarano et al. 2023, "Multi-step model predictive safety filters".
"""

import numpy as np

CUTOFF = 10.0  # [Hz]
AMPLITUDE_THRESHOLD = 0.05
ZERO_PADDING = 4  # powers of two
CORRECTION = 0.01  # of a velocity from which it counts [m/s, rad/s]


def sparc(speed: np.ndarray, fs: float) -> float:
    """Return the spectral arc length: 0 is smoothest, more negative is less smooth.

    −∫₀^ωc √((1/ωc)² + (dV̂/dω)²) dω, where V̂ is the amplitude spectrum over its value at its peak and ωc the
    highest frequency up to 10 Hz, and to fs/2, at which V̂ ≥ 0.05. Independent of duration and scale.

    Args:
        speed: Speed, `(N,)`, in any unit.
        fs: Samples a second [Hz].

    Returns:
        The measure (minimum jerk: about −1.4), or NaN if nothing moves or there are fewer than two samples.
    """
    if not _moves(speed):
        return float("nan")
    size = 2 ** (int(np.ceil(np.log2(len(speed)))) + ZERO_PADDING)
    spectrum = np.abs(np.fft.fft(speed, size))
    frequency = np.arange(size) * fs / size
    low = frequency <= min(CUTOFF, 0.5 * fs)
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
        The measure (minimum jerk: about −5.3), or NaN if nothing moves, the speed is even, or there are fewer
        than three samples.
    """
    jerk = np.diff(speed, 2) * fs**2
    if not _moves(speed) or not jerk.any() or np.ptp(speed) <= 1e-4 * np.abs(speed).max():  # even
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


def rate_of_change(command: np.ndarray, fs: float) -> float:
    """Return the norm of the rate of change of a command: 0 is a command that never changes.

    √(1/(N−1) Σ_t ‖(u_{t+1} − u_t) fs‖²): the norm over the whole episode, made independent of its length.

    Args:
        command: `(N, d)`, in any unit.
        fs: Samples a second [Hz].

    Returns:
        The measure, a velocity's in [m/s², rad/s²], or NaN if there are fewer than two samples or one is not
        finite.
    """
    if len(command) < 2 or not np.isfinite(command).all():
        return float("nan")
    changes = np.diff(command, axis=0) * fs
    return float(np.sqrt(np.mean(np.sum(changes**2, axis=1))))


def high_frequency_content(command: np.ndarray, fs: float) -> float:
    """Return the amplitude spectrum weighted by frequency, summed over the columns: 0 is a constant command.

    Σ_f f · (2/N) |FFT(u)(f)| over the frequencies f = k fs / N with 0 < f ≤ fs/2. A vibration of amplitude A
    and frequency f below fs/2 adds A · f. Noise adds more in a longer episode, about as √N: compare episodes
    of like length.

    Args:
        command: `(N, d)`, in any unit.
        fs: Samples a second [Hz].

    Returns:
        The measure [unit · Hz], or NaN if there are fewer than two samples or one is not finite.
    """
    size = len(command)
    if size < 2 or not np.isfinite(command).all():
        return float("nan")
    frequency = np.fft.rfftfreq(size, 1.0 / fs)
    return float((frequency @ (2.0 / size * np.abs(np.fft.rfft(command, axis=0)))).sum())


def corrections(
    asked: np.ndarray, commanded: np.ndarray, owned: np.ndarray, tolerance: float = CORRECTION
) -> int:
    """Return how often the correction of a command switched on or off.

    It is on where `|commanded − asked| > tolerance` on any owned channel, and off before the first sample.

    Args:
        asked: The operator's intent, `(N, d)`.
        commanded: The command sent on the same channels, `(N, d)`.
        owned: Where the operator owned a channel, `(N, d)`; elsewhere nothing was asked.
        tolerance: Largest difference that is no correction.
    """
    on = np.any(owned & (np.abs(commanded - asked) > tolerance), axis=1)
    return int(np.count_nonzero(np.diff(on, prepend=False)))


def _moves(speed: np.ndarray) -> bool:
    return len(speed) > 1 and bool(np.isfinite(speed).all()) and bool(speed.any())

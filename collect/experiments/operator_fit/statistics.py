"""Summary statistics of how somebody steered, beside what an operator without any weakness would do.

Each is a ratio of two sums over an episode, so that episodes add up; sums over the channels do not depend on
the axes in which a twist is written. u: inputs over full stick; w: what is wanted; Δu: the change in a frame.
"""

import numpy as np
from scipy.special import softmax

from handrail.controllers.arrays import BoolArray, FloatArray

STEPS = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8)  # [s]
LAGS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8)  # [s]
RHYTHM = tuple(np.round(np.arange(0.05, 1.25, 0.05), 2).tolist())  # [s]
LEVELS = ((0.02, 0.2), (0.2, 0.6), (0.6, 1.01))  # of full stick
_TOUCHED = 0.02  # of full stick: below, an input is let go
_BURST, _QUIET = 0.85, 0.02
_NOTHING = 1e-6
_FIRST = 3  # of the rhythm's times, from which on it may be a movement of its own
_PEAK, _MATCH = 0.01, 0.1  # how sharply the largest is taken, in the unit of what is compared
_SPAN = 0.15  # over which an answer is looked for [s]

NAMES = (
    *(f"change in {step:g} s" for step in STEPS),
    *(f"miss, {lag:g} s late" for lag in LAGS),
    *(f"noise from {low:g} to {high:g} of full stick" for low, high in LEVELS),
    *(f"answer to a change, {lag:g} s late" for lag in LAGS),
    *(f"rhythm at {step:g} s" for step in RHYTHM),
    "push over what is wanted, near the goal",
    "change that comes in bursts",
    "frames without a change",
    "frames with an input in use",
    "mean input",
    "time to the first input after a switch [s]",
    "period of the rhythm [s]",
    "delay of the best match [s]",
)
_MISSES = slice(len(STEPS), len(STEPS) + len(LAGS))
_LOGS = len(STEPS) + len(LAGS) + len(LEVELS)  # of the first so many the logarithm counts
_RHYTHMS = slice(_LOGS + len(LAGS), _LOGS + len(LAGS) + len(RHYTHM))


def sums(inputs: FloatArray, wanted: FloatArray, owned: BoolArray, fps: float) -> FloatArray:
    """Return numerators and denominators of an episode's statistics, (2, s).

    Args:
        inputs: over full stick, (T, m).
        wanted: the same of an operator without any weakness, (T, m).
        owned: which channels were the operator's, (T, m).
        fps: frames a second [Hz].
    """
    power, frames = float(np.sum(inputs**2)), float(len(inputs))
    change = np.diff(inputs, axis=0)
    changed, total = np.sum(change**2, axis=1), float(np.sum(change**2))
    length = np.linalg.norm(inputs, axis=1)
    quiet = np.sqrt(changed) <= _QUIET * length[1:]
    near = np.linalg.norm(wanted, axis=1) < 0.7 * max(float(np.linalg.norm(wanted, axis=1).max()), _NOTHING)
    pairs: list[tuple[float, float]] = [
        *((float(np.sum(_late(inputs, -step, fps) ** 2)), power) for step in STEPS),
        *((float(np.sum(_miss(inputs, wanted, lag, fps) ** 2)), power) for lag in LAGS),
        *(_noise(inputs, *level) for level in LEVELS),
        *(_answer(inputs, wanted, lag, fps) for lag in LAGS),
        *(_rhythm(change, step, fps, total) for step in RHYTHM),
        (float(np.sum(inputs[near] * wanted[near])), float(np.sum(wanted[near] ** 2))),
        (float(np.sum(np.sort(changed)[int(_BURST * len(changed)) :])), total),
        (float(np.sum(quiet & (length[1:] > _TOUCHED))), frames),
        (float(np.sum(length > _TOUCHED)), frames),
        (float(np.sum(length)), frames),
        _after_switches(length, owned, fps),
    ]
    return np.array(pairs).T


def statistics(of_episodes: FloatArray) -> FloatArray:
    """Return the statistics of episodes together, (…, s); 0 where there is nothing to count.

    Args:
        of_episodes: sums of each, (…, E, 2, s).
    """
    over, under = np.moveaxis(of_episodes.sum(axis=-3), -2, 0)
    known = under > _NOTHING
    ratio = np.where(known, over / np.where(known, under, 1.0), 0.0)
    logs = np.where(known, np.log(np.maximum(ratio, _NOTHING)), 0.0)[..., :_LOGS]
    beats = ratio[..., _RHYTHMS][..., _FIRST:]
    period = _place_of_largest(beats / _PEAK, RHYTHM[_FIRST:])
    delay = _place_of_largest(-logs[..., _MISSES] / _MATCH, LAGS)
    return np.concatenate([logs, ratio[..., _LOGS:], period, delay], axis=-1)


def _place_of_largest(values: FloatArray, places: tuple[float, ...]) -> FloatArray:
    """Return where the largest is, (…, 1), so that it goes smoothly from one place to the next."""
    return softmax(values, axis=-1) @ np.array(places)[:, None]


def resampled(of_episodes: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Return the statistics of resampled episodes, (count, s)."""
    episodes = len(of_episodes)
    weights = rng.multinomial(episodes, np.full(episodes, 1.0 / episodes), size=count)
    return statistics(np.einsum("ce,eps->cps", weights, of_episodes)[:, None])


def _frames(seconds: float, fps: float) -> int:
    return round(seconds * fps)


def _late(values: FloatArray, step: float, fps: float) -> FloatArray:
    """Return how much values change in a time, (T − k, m)."""
    frames = max(1, _frames(abs(step), fps))
    return values[frames:] - values[:-frames]


def _pair(inputs: FloatArray, wanted: FloatArray, lag: float, fps: float) -> tuple[FloatArray, FloatArray]:
    frames = _frames(lag, fps)
    return inputs[frames:], wanted[: len(wanted) - frames]


def _miss(inputs: FloatArray, wanted: FloatArray, lag: float, fps: float) -> FloatArray:
    late, before = _pair(inputs, wanted, lag, fps)
    return late - before


def _answer(inputs: FloatArray, wanted: FloatArray, lag: float, fps: float) -> tuple[float, float]:
    """Return how much of a change of what is wanted comes a time later: Σ Δu(t) Δw(t − lag) over Σ Δw²."""
    late, before = _pair(_late(inputs, _SPAN, fps), _late(wanted, _SPAN, fps), lag, fps)
    return float(np.sum(late * before)), float(np.sum(before**2))


def _rhythm(change: FloatArray, step: float, fps: float, total: float) -> tuple[float, float]:
    frames = _frames(step, fps)
    return float(np.sum(change[frames:] * change[: len(change) - frames])), total


def _noise(inputs: FloatArray, low: float, high: float) -> tuple[float, float]:
    """Return how restless inputs are that are pushed so far: second differences squared, over the inputs'."""
    middle, second = inputs[1:-1], inputs[2:] - 2.0 * inputs[1:-1] + inputs[:-2]
    within = (np.abs(middle) >= low) & (np.abs(middle) < high)
    return float(np.sum(second[within] ** 2)), float(np.sum(middle[within] ** 2))


def _after_switches(length: FloatArray, owned: BoolArray, fps: float) -> tuple[float, float]:
    """Return the time from each change of channels to the next input [s], all together, and their number."""
    switches = np.flatnonzero(np.any(np.diff(owned.astype(int), axis=0) != 0, axis=1)) + 1
    waits = [np.flatnonzero(length[place:] > _TOUCHED) for place in switches]
    found = [float(wait[0]) / fps for wait in waits if len(wait)]
    return float(np.sum(found)), float(len(found))

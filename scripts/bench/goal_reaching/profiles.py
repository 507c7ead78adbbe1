"""Command profiles: how the planner's twist reaches the controller, faster or jerkier than it left."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from handrail.collect.world.tasks.goal_reaching import STEP, T_MAX, StraightPlanner
from handrail.controllers.arrays import FloatArray, IntArray

SPEEDS = {"fast15": 1.5, "fast2": 2.0, "fast3": 3.0}
NOTHING_YET = -1

_BURST = 10  # `steps`: so many steps at double speed, then as many at rest
_NOISE = 0.3  # `noise`: standard deviation over the speed
_TREMOR = (0.1, 0.5)  # `noise`: time constants of the band it lies in [s]
_DELAYS = (4, 7)  # `delay`: a message takes so many steps, 0.12 to 0.21 s
_LINK, _LOST = (20, 100), (4, 24)  # `dropouts`: steps with and without a link: 0.6 to 3 s, 0.12 to 0.72 s
_WATCHDOG = 8  # `dropouts`: steps after which a robot without messages rests (0.25 s)
_PRESS = 10  # `quantised`: steps between two decisions which keys to press (0.3 s)
_KEYS = np.array([0.15] * 3 + [0.5] * 3)  # `quantised`: what a key commands [m/s, rad/s]


@dataclass(frozen=True)
class Commands:
    """An operator's messages in each of the T steps of an episode, and the delivered ones."""

    twists: FloatArray  # sent, world-aligned at the tool [m/s, rad/s], (T, 6)
    progress: FloatArray  # how far along its line the planner is, in its own steps, (T,)
    delivered: IntArray  # which message is the newest that arrived, (T,); `NOTHING_YET` before the first
    end: int  # first step from which on nothing but rest arrives


def profile_commands(profile: str, planner: StraightPlanner, rng: np.random.Generator) -> Commands:
    """Return a profile's commands; each keeps the planned displacement, so that a perfect robot arrives.

    Args:
        profile: one of `PROFILES` of the settings, which refuse others.
        planner: at the profile's speed, `SPEEDS`.
        rng: of noise, delays and dropouts.
    """
    now, rates = np.arange(T_MAX), np.ones(T_MAX)
    delivered = now
    if profile == "steps":
        rates = np.where(now // _BURST % 2 == 0, 2.0, 0.0)
    elif profile == "delay":
        delivered = _delayed(rng)
    elif profile == "dropouts":
        delivered = _with_gaps(rng)
        rates = np.where(now - delivered <= _WATCHDOG, 1.0, 0.0)
    progress = np.minimum(np.append(0.0, np.cumsum(rates)), planner.steps)
    twists = np.diff(progress)[:, None] * planner.velocity
    if profile == "noise":
        twists = _noisy(twists, rng)
    elif profile == "quantised":
        twists = _quantised(twists)
    arriving = np.where(delivered[:, None] == NOTHING_YET, 0.0, twists[delivered])
    moving = np.flatnonzero(arriving.any(axis=1))
    return Commands(twists, progress[:-1], delivered, int(moving[-1]) + 1 if len(moving) else 0)


def _delayed(rng: np.random.Generator) -> IntArray:
    """Return messages that take a random while and keep their order."""
    arrivals = np.arange(T_MAX) - rng.integers(*_DELAYS, T_MAX, endpoint=True)
    return np.maximum(np.maximum.accumulate(arrivals), NOTHING_YET)


def _with_gaps(rng: np.random.Generator) -> IntArray:
    """Return messages of which none arrive while the link is lost."""
    delivered = np.arange(T_MAX)
    start = 0
    while start < T_MAX:
        start += int(rng.integers(*_LINK, endpoint=True))
        end = start + int(rng.integers(*_LOST, endpoint=True))
        delivered[start:end] = start - 1
        start = end
    return delivered


def _noisy(twists: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Add a tremor in proportion to the speed and to the turning rate.

    It is white noise through a fast low-pass minus the same through a slow one, scaled to variance 1: it
    comes and goes, and leaves the hand where it was.
    """
    white, keep = rng.standard_normal(twists.shape), np.exp(-STEP / np.array(_TREMOR))
    one, other = (np.asarray(lfilter([1.0 - each], [1.0, -each], white, axis=0)) for each in keep)
    fast, slow = keep
    own = (1.0 - fast) / (1.0 + fast) + (1.0 - slow) / (1.0 + slow)
    variance = own - 2.0 * (1.0 - fast) * (1.0 - slow) / (1.0 - fast * slow)
    speed, rate = (np.linalg.norm(part, axis=1, keepdims=True) for part in (twists[:, :3], twists[:, 3:]))
    sizes = np.repeat(np.hstack([speed, rate]), 3, axis=1)
    return twists + _NOISE / np.sqrt(variance) * sizes * (one - other)


def _quantised(twists: FloatArray) -> FloatArray:
    """Press keys of one speed so often that the displacement comes out; a decision makes up for the last.

    Of what is still owed, (6,), a key takes its share for one press whenever that is more than half of it.
    """
    pressed = np.zeros_like(twists)
    owed = np.zeros(6)
    for start in range(0, len(twists), _PRESS):
        part = slice(start, start + _PRESS)
        owed += twists[part].sum(axis=0)
        quantum = _KEYS * len(twists[part])
        keys = np.where(np.abs(owed) > 0.5 * quantum, np.sign(owed), 0.0)
        pressed[part] = keys * _KEYS
        owed -= keys * quantum
    return pressed

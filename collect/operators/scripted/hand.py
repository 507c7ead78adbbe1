"""The human-like eye and hand: misjudgement, delay, intermittency, minimum jerk, noise, drift."""

import math
from collections import deque
from dataclasses import replace

import numpy as np

from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.steering import MotionGoal, hand_errors, length
from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import matrix_from_vector
from handrail.controllers.robot.model import Pose

_JUST = 1e-9  # of rounding [s]


class Wander:
    """Independent processes of unit variance: `x(t + h) = e^{−h/τ} x(t) + √(1 − e^{−2h/τ}) ξ`.

    Args:
        shape: of x.
        correlation: time constant τ [s]; 0 stands still.
        rng: drawn from.
    """

    def __init__(self, shape: tuple[int, ...], correlation: float, rng: np.random.Generator) -> None:
        self._correlation, self._rng = correlation, rng
        self._value = rng.standard_normal(shape)
        self._time: float | None = None

    def at(self, time: float) -> FloatArray:
        """Return x at a time that is not before the last one [s]."""
        if self._time is not None and self._correlation > 0:
            keep = math.exp(-(time - self._time) / self._correlation)
            fresh = self._rng.standard_normal(self._value.shape)
            self._value = keep * self._value + math.sqrt(1.0 - keep**2) * fresh
        self._time = time
        return self._value


class Perception:
    """Adds `σ ‖x‖ a` to each distance to go x, where a is an Ornstein–Uhlenbeck process (Weber's law).

    x is the way of the hand, its turn, the way of the base, its turn. It is the same in every teleop mode:
    what is misjudged is the task, not the input. An operator who thinks of joints thinks of those that would
    put the hand where it seems to belong: the error at the hand is that of who steers the hand.

    Args:
        settings: of the person.
        rng: of the episode.
    """

    def __init__(self, settings: HumanSettings, rng: np.random.Generator) -> None:
        self._share = settings.misjudgement
        self._wander = Wander((9,), settings.correlation, rng)

    def see(self, goal: MotionGoal, tool: Pose, time: float, other: Pose | None = None) -> MotionGoal:
        """Return the goal as it comes out of what is seen at a time [s]; `other`: the second hand's tool."""
        off = self._share * self._wander.at(time)
        if not self._share:
            return goal
        hand, base, target = off[:6], off[6:], goal.target
        if target is not None:
            also = _seen(other, target.also, hand) if other and target.also else None
            target = replace(target, hand=_seen(tool, target.hand, hand), also=also, meant=target.hand)
        hand, base = _off(goal.hand, hand, 3), _off(goal.base, base, 2)
        return replace(goal, hand=hand, base=base, target=target)


def _seen(tool: Pose, goal: Pose, share: FloatArray) -> Pose:
    """Return where a goal of a tool is as it is misjudged by a share of the way there, (6,)."""
    way = _off(hand_errors(tool, goal), share, 3)
    return Pose(tool.position + way[:3], matrix_from_vector(way[3:]) @ tool.rotation)


def _off(vector: FloatArray, share: FloatArray, lengths: int) -> FloatArray:
    """Return a way and a turn that are misjudged by shares of their norms; the way has so many numbers."""
    sizes = np.empty(len(vector))
    sizes[:lengths], sizes[lengths:] = length(vector[:lengths]), length(vector[lengths:])
    return vector + sizes * share


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
        self._settings, self._full, self._fine = settings, full, fine
        self._seen: deque[tuple[float, FloatArray]] = deque()
        self._left = self._held = np.zeros(len(full))  # where the last movement began, and where it ends
        self._moved = -np.inf
        self._wander = Wander((2, len(full)), settings.correlation, rng)

    def move(self, wanted: FloatArray, time: float) -> FloatArray:
        """Return what the hand commands at a time [s], given what the operator wants now, (k,)."""
        self._correct(self._delayed(wanted, time), time)
        noise, drift = self._wander.at(time)
        settings, held = self._settings, self._position(time)
        size = np.abs(held)
        moved = held + settings.noise * size * noise + settings.drift * self._fine * drift * (size > 0)
        within = np.minimum(np.maximum(moved, -self._full), self._full)
        return within if settings.noise or settings.drift else moved

    def _delayed(self, wanted: FloatArray, time: float) -> FloatArray:
        seen, latest = self._seen, time - self._settings.delay + _JUST
        seen.append((time, np.array(wanted, dtype=float)))
        while len(seen) > 1 and seen[1][0] <= latest:
            seen.popleft()
        return seen[0][1] if seen[0][0] <= latest else np.zeros_like(self._held)

    def _correct(self, wanted: FloatArray, time: float) -> None:
        """Begin a movement if there is reason to, and it may begin."""
        refractory, released = self._settings.refractory, not wanted.any()
        change = (np.abs(wanted - self._held) / self._fine).max()
        may = change > self._settings.threshold and time - self._moved >= refractory - _JUST
        if (released or may or not refractory) and (wanted != self._held).any():
            self._left = np.zeros_like(self._held) if released else self._position(time)
            self._held, self._moved = wanted, time

    def _position(self, time: float) -> FloatArray:
        """Return where the hand is on its way, without noise, (k,)."""
        if not math.isfinite(self._moved) or not self._settings.movement:
            return self._held
        share = minimum_jerk((time - self._moved) / self._settings.movement)
        return self._left + share * (self._held - self._left)


def minimum_jerk(share: float) -> float:
    """Return how far a minimum-jerk movement is after a share of its time: `10τ³ - 15τ⁴ + 6τ⁵`."""
    tau = min(max(share, 0.0), 1.0)
    return tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)

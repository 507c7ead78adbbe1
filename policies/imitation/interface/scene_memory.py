"""A memory of estimates, in the world's axes: a Kalman filter of a thing that stands or moves.

    P ← P + q 1                        a frame later; q is small for what stands, or is out of reach
    K = P (P + Σ)⁻¹                    Σ: how far what a camera says now is off
    x ← x + K (y − x),  P ← (1 − K) P

So a place is found from its rays, by several cameras and by one that moves. An estimate far from the known
place counts only when it comes again and again: P grows meanwhile, until it fits. NaN and infinity never
count.
"""

from collections.abc import Mapping, Sequence
from copy import copy

import numpy as np
from scipy.spatial.transform import Rotation

from handrail.controllers.arrays import FloatArray
from handrail.policies.imitation.interface.encoder import Reads, Said, same

_STANDS, _MOVES = (0.0005, 0.002), (0.02, 0.10)  # √q, a frame: of the place [m], of the turn
_REACH = 0.2  # from a tool, beside how far off that is [m]
_FAR = 4.0  # standard deviations
_DOUBT = 1.2  # by which P grows where what is said is farther
_TURN = 0.5  # of the determinant of a rotation, which is 1: less is none
_ALIKE = 4.0  # frames that say as much as one of what stands: what is off now is off a frame later


class SceneMemory:
    """The known objects of one episode.

    Args:
        reads: of the encoder.
    """

    def __init__(self, reads: Reads) -> None:
        self._reads = reads
        self._known = {
            name: _Known(reads.turns.get(name, 1), name in reads.movable) for name, _, _ in reads.objects
        }

    def copy(self) -> "SceneMemory":
        """Return one that knows the same, and learns by itself."""
        twin = copy(self)
        twin._known = {name: copy(each) for name, each in self._known.items()}
        return twin

    def take(self, said: Mapping[str, Sequence[Said]], moment: int) -> FloatArray:
        """Take what is said at a moment, and return the environment's state as it is known, (e,) float32."""
        numbers = np.zeros(len(self._reads.interface.environment_names), np.float32)
        for name, parts, start in self._reads.objects:
            numbers[start : start + len(parts)] = self._known[name].take(said[name], moment)
        return numbers


class _Known:
    """The state of an object, from all estimates.

    Args:
        turns: it looks the same after so many-th of a turn around its z axis.
        movable: whether it may move.
    """

    def __init__(self, turns: int, movable: bool) -> None:
        self._same = same(turns)
        self._place, self._turn = np.zeros(3), np.eye(3)
        self._spread: FloatArray | None = None  # P
        self._turn_variance = np.inf
        self._movable = movable

    def take(self, said: Sequence[Said], moment: int) -> FloatArray:
        """Take what the cameras say at a moment; return position, (3,), or with its quaternion, (7,)."""
        alike = _ALIKE
        if self._spread is not None:
            away = min(float(np.linalg.norm(self._place - tool)) for tool in said[0].tools[moment])
            moves = self._movable and away < _REACH + np.sqrt(np.trace(self._spread))
            drift, turn_drift = _MOVES if moves else _STANDS
            alike = 1.0 if moves else _ALIKE
            self._spread = self._spread + drift**2 * np.eye(3)
            self._turn_variance += turn_drift**2
        for each in said:
            self._take_place(each.position[moment], each.spread[moment], alike)
            if each.rotation is not None and each.turned_off is not None:
                self._take_turn(each.rotation[moment], float(each.turned_off[moment]), alike)
        if said[0].rotation is None:
            return self._place
        quaternion = Rotation.from_matrix(self._turn).as_quat(canonical=True, scalar_first=True)
        return np.append(self._place, quaternion)

    def _take_place(self, place: FloatArray, spread: FloatArray, alike: float) -> None:
        if not (np.isfinite(place).all() and np.isfinite(spread).all()):
            return
        if self._spread is None:
            self._place, self._spread = place, spread
            return
        away = place - self._place
        if away @ np.linalg.solve(self._spread + spread, away) > _FAR**2:
            self._spread = _DOUBT * self._spread
            return
        share = np.linalg.solve(self._spread + alike * spread, self._spread).T
        self._place = self._place + share @ away
        kept = self._spread - share @ self._spread
        self._spread = 0.5 * (kept + kept.T)

    def _take_turn(self, turn: FloatArray, off: float, alike: float) -> None:
        if not (np.isfinite(turn).all() and np.isfinite(off) and np.linalg.det(turn) > _TURN):
            return
        ways = turn @ self._same
        nearest = ways[np.argmax(np.einsum("kij,ij->k", ways, self._turn))]
        if np.isinf(self._turn_variance):
            self._turn, self._turn_variance = nearest, off**2
            return
        away = Rotation.from_matrix(nearest @ self._turn.T).as_rotvec()
        if away @ away > _FAR**2 * (self._turn_variance + off**2):
            self._turn_variance *= _DOUBT
            return
        share = self._turn_variance / (self._turn_variance + alike * off**2)
        self._turn = (Rotation.from_rotvec(share * away) * Rotation.from_matrix(self._turn)).as_matrix()
        self._turn_variance *= 1.0 - share

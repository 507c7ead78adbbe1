"""What was said before is remembered, in the world's axes: a Kalman filter of an object that stands or moves.

    P ← P + q                          a frame later; q is small for what stands, or is out of reach
    K = P / (P + r²)                   r: how far what is said now is off
    x ← x + K (y − x),  P ← (1 − K) P

What is far from what is known counts only when it is said again and again: P grows meanwhile, until it fits.
NaN and infinity never count.
"""

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from handrail.controllers.arrays import FloatArray
from handrail.policies.imitation.interface.encoder import Reads, Said, same

_STANDS, _MOVES = (0.0005, 0.002), (0.02, 0.10)  # √q, a frame: of the place [m], of the turn
_REACH = 0.2  # from the tool, beside how far off that is [m]
_FAR = 4.0  # standard deviations
_DOUBT = 1.2  # by which P grows where what is said is farther


class SceneMemory:
    """What is known of the objects of one episode.

    Args:
        reads: of the encoder.
    """

    def __init__(self, reads: Reads) -> None:
        self._reads = reads
        self.forget()

    def forget(self) -> None:
        """Forget all: an episode begins."""
        reads = self._reads
        self._known = {
            name: _Known(reads.turns.get(name, 1), name in reads.movable) for name, _, _ in reads.objects
        }

    def take(self, said: Mapping[str, Said], moment: int) -> FloatArray:
        """Take what is said at a moment, and return the environment's state as it is known, (e,) float32."""
        numbers = np.zeros(len(self._reads.interface.environment_names), np.float32)
        for name, parts, start in self._reads.objects:
            numbers[start : start + len(parts)] = self._known[name].take(said[name], moment)
        return numbers


class _Known:
    """What is known of an object, from all that was said.

    Args:
        turns: it looks the same after so many-th of a turn around its z axis.
        movable: whether it may move.
    """

    def __init__(self, turns: int, movable: bool) -> None:
        self._same = same(turns)
        self._place, self._turn = np.zeros(3), np.eye(3)
        self._movable = movable
        self._sure, self._turn_sure = _Variance(), _Variance()

    def take(self, said: Said, moment: int) -> FloatArray:
        """Take what is said at a moment; return position, and quaternion if it has one, (3,) or (7,)."""
        moves = self._movable and said.away[moment] < _REACH + said.off[moment]
        drift, turn_drift = _MOVES if moves else _STANDS
        away = said.position[moment] - self._place
        if share := self._sure.share(float(np.linalg.norm(away)), said.off[moment], drift):
            self._place = self._place + share * away
        if said.rotation is None or said.turned_off is None:
            return self._place
        if not np.isfinite(said.rotation[moment]).all():
            return self._pose
        ways = said.rotation[moment] @ self._same
        nearest = ways[np.argmax(np.einsum("kij,ij->k", ways, self._turn))]
        turn = Rotation.from_matrix(nearest @ self._turn.T).as_rotvec()
        share = self._turn_sure.share(float(np.linalg.norm(turn)), said.turned_off[moment], turn_drift)
        now = Rotation.from_rotvec(share * turn) * Rotation.from_matrix(self._turn)
        self._turn = now.as_matrix()
        return self._pose

    @property
    def _pose(self) -> FloatArray:
        quaternion = Rotation.from_matrix(self._turn).as_quat(canonical=True, scalar_first=True)
        return np.append(self._place, quaternion)


class _Variance:
    """P: how far off what is known is, squared."""

    def __init__(self) -> None:
        self._variance = np.inf

    def share(self, away: float, off: float, drift: float) -> float:
        """Return K for what is said; 0 where it is too far away to be believed.

        Args:
            away: how far it is from what is known.
            off: r.
            drift: √q.
        """
        self._variance += drift**2
        if not np.isfinite(away + off):
            return 0.0
        if np.isinf(self._variance):
            self._variance = off**2
            return 1.0
        if away**2 > _FAR**2 * (self._variance + off**2):
            self._variance *= _DOUBT
            return 0.0
        share = self._variance / (self._variance + off**2)
        self._variance *= 1.0 - share
        return float(share)

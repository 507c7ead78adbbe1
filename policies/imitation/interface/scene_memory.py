"""What was said before is remembered, in the world's axes, for as long as it fits.

    x ← (λ w x + v y) / (λ w + v)     with the weight v = 1 / b² of what is said now
    w ← λ w + v                       of all before

What is far from all before begins anew: it moved, or it is another episode.
"""

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from handrail.controllers.arrays import FloatArray
from handrail.policies.imitation.interface.encoder import Reads, Said, same

_KEPT = 0.9  # λ, a frame
_SURPRISE = 4.0  # of what is expected to be off: from there on it begins anew


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
        self._known = {name: _Known(self._reads.turns.get(name, 1)) for name, _, _ in self._reads.objects}

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
    """

    def __init__(self, turns: int) -> None:
        self._same = same(turns)
        self._weight, self._place = 0.0, np.zeros(3)
        self._turn_weight, self._turn = 0.0, np.eye(3)

    def take(self, said: Said, moment: int) -> FloatArray:
        """Take what is said at a moment; return position, and quaternion if it has one, (3,) or (7,)."""
        place, off = said.position[moment], said.off[moment]
        surprise = np.linalg.norm(place - self._place)
        if self._weight and surprise > _SURPRISE * np.hypot(off, self._weight**-0.5):
            self._weight = self._turn_weight = 0.0
        before, now = _KEPT * self._weight, off**-2.0
        self._weight = before + now
        self._place = (before * self._place + now * place) / self._weight
        if said.rotation is None or said.turned_off is None:
            return self._place
        ways = said.rotation[moment] @ self._same
        turn = ways[np.argmax(np.einsum("kij,ij->k", ways, self._turn))]
        before, now = _KEPT * self._turn_weight, said.turned_off[moment] ** -2.0
        self._turn_weight = before + now
        mixed = Rotation.from_matrix(np.stack([self._turn, turn])).mean([before, now])
        self._turn = mixed.as_matrix()
        return np.append(self._place, mixed.as_quat(canonical=True, scalar_first=True))

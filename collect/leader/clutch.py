"""The clutch of a leader arm: while it holds, the arm moves as the leader does; nothing ever jumps."""

import numpy as np

from handrail.controllers.arrays import FloatArray

_LEAD = 0.3  # how far targets may be ahead of the arm; what is more slips [rad]


class Clutch:
    """Joint targets from a leader's motion: `q_target = q₀ + (l − l₀)`, from where both were at the grip.

    Where the arm cannot follow (a limit, an obstacle, a slow mode), the leader slips: targets stay within
    0.3 rad of the arm and within its limits, and what was too much is forgotten, so that the arm stands soon
    after the leader does, and turns back as soon as the leader does.

    Args:
        lower: limits of the arm's joints [rad], (n,).
        upper: the same.
    """

    def __init__(self, lower: FloatArray, upper: FloatArray) -> None:
        self._lower, self._upper = lower, upper
        self._offset: FloatArray | None = None

    @property
    def holds(self) -> bool:
        """Whether it held last time."""
        return self._offset is not None

    def targets(self, engaged: bool, leader: FloatArray, arm: FloatArray) -> tuple[float, ...]:
        """Return where the arm's joints shall go [rad], (n,); nowhere, (0,), while it is let go.

        Args:
            engaged: whether the operator holds it.
            leader: the leader's joints, in the arm's terms [rad], (n,).
            arm: the arm's joints [rad], (n,).
        """
        if not engaged:
            self._offset = None
            return ()
        if self._offset is None:
            self._offset = arm - leader
        wanted = leader + self._offset
        kept = np.clip(np.clip(wanted, arm - _LEAD, arm + _LEAD), self._lower, self._upper)
        self._offset = self._offset + (kept - wanted)
        return tuple(kept.tolist())

"""How often things happen in a loop that goes on in steps."""

_ROUNDING = 1e-9  # [s]


class Rate:
    """Says at which steps something is due that happens once a period; the first time at once.

    Args:
        period: [s].
    """

    def __init__(self, period: float) -> None:
        self._period, self._next = period, 0.0

    def due(self, time: float) -> bool:
        """Whether it is due at a step's time [s]."""
        return time >= self._next - _ROUNDING

    def take(self) -> None:
        """Take note that it happens."""
        self._next += self._period

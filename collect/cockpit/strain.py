"""How far behind a loop is, and what waits longer then: pictures first, then those who only watch."""

_FORGETS = 0.98  # share that is left at the next note
_PICTURES = ((0.01, 0.1), (0.03, 0.3))  # up to which lag, how long between two pictures [s]
_SPECTATORS = ((0.03, 0.1),)  # the same for their frames [s]
_LONG_PICTURES, _LONG_SPECTATORS = 1.0, 0.5  # [s]


class Strain:
    """Notes by how much a loop was late."""

    def __init__(self) -> None:
        self._lag = 0.0

    def note(self, lag: float) -> None:
        """Take by how much a turn of the loop was late [s]."""
        self._lag = max(lag, _FORGETS * self._lag)

    @property
    def picture_period(self) -> float:
        """From one picture to the next [s]."""
        return next((period for most, period in _PICTURES if self._lag <= most), _LONG_PICTURES)

    @property
    def spectator_period(self) -> float:
        """From one frame of a spectator to the next [s]."""
        return next((period for most, period in _SPECTATORS if self._lag <= most), _LONG_SPECTATORS)

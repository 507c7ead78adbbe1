"""Rates: of the controller, and of a recording."""

from dataclasses import replace

from handrail.datasets.recording.frames import Frame

_ROUNDING = 1e-9  # [s]


class Rate:
    """Says at which steps something is due that happens once a period.

    Args:
        period: [s].
        start: when it is due first [s].
    """

    def __init__(self, period: float, start: float = 0.0) -> None:
        self._period, self._next = period, start

    def due(self, time: float) -> bool:
        """Whether it is due at a step's time [s]."""
        return time >= self._next - _ROUNDING

    def take(self) -> None:
        """Take note that it happens."""
        self._next += self._period


class Sampling:
    """Makes the frames of a recording from those of the robot's periods.

    Args:
        period: of the recording [s].

    Attributes:
        number: of the frames so far.
    """

    def __init__(self, period: float) -> None:
        self._period, self._next = period, period
        self._open: Frame | None = None
        self.number = 0

    def add(self, frame: Frame, time: float) -> Frame | None:
        """Take a period that ends at a time [s]; return the frame that is complete with it, if one is."""
        lasting = _lasting(self._open, frame) if self._open else frame
        if not (frame.done or time >= self._next - _ROUNDING):
            self._open = lasting
            return None
        self._next += self._period
        self._open, self.number = None, self.number + 1
        return replace(lasting, number=self.number - 1)


def _lasting(first: Frame, last: Frame) -> Frame:
    """Return the frame of some periods: observed and asked at the first one, sent at the last one."""
    return replace(
        last,
        state=first.state,
        environment=first.environment,
        images=first.images,
        intent=first.intent,
        wall_clock=first.wall_clock,
        contacts=max(first.contacts, last.contacts),
    )

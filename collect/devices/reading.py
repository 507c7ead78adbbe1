"""What a device says of one moment, and what a device is."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from handrail.controllers.errors import HandrailError


class DeviceGoneError(HandrailError):
    """A device cannot be read: unplugged, not to be opened, silent for good. The message says what to do."""


@dataclass(frozen=True)
class Reading:
    """Where the controls of a device are.

    Attributes:
        time: when that was, on the operator's clock [s].
        deflections: of the controls that are not at rest, from −1 to 1.
        presses: controls that went down since the reading before, in their order.
        attended: whether somebody is there: a terminal in focus, a device that works.
        joints: positions of a leader arm's joints, in its own units, by LeRobot's names.
        round_trip: from asking the device to its answer, where it is asked [s].
    """

    time: float
    deflections: Mapping[str, float] = field(default_factory=dict)
    presses: tuple[str, ...] = ()
    attended: bool = True
    joints: Mapping[str, float] = field(default_factory=dict)
    round_trip: float = 0.0


class Device(Protocol):
    """Something in a person's hand. One thread opens, reads and closes it."""

    @property
    def name(self) -> str:
        """What the data call it."""
        ...

    def open(self) -> None:
        """Find it and get it ready.

        Raises:
            DeviceGoneError: it is not there, or may not be used; the message says what to do.
        """
        ...

    def read(self) -> Reading:
        """Return where its controls are; called again and again, waits 0.01 s at most.

        Raises:
            DeviceGoneError: it is not there any more.
        """
        ...

    def close(self) -> None:
        """Give it back, also one that is gone."""
        ...

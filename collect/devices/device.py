"""The interface of a device, its reading of one moment, and the shape of its sticks."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol


@dataclass(frozen=True)
class DeviceInput:
    """The reading of a device at one moment, in the words of its controls or, after its map, of the robot."""

    time: float
    """When that was, on the operator's clock [s]."""
    deflections: Mapping[str, float] = field(default_factory=dict)
    """Of the controls that are not at rest, from −1 to 1; after the map of channels, `hold` and `clutch`."""
    presses: tuple[str, ...] = ()
    """Controls that went down since the input before, or the actions that they ask for, in their order."""
    attended: bool = True
    """Whether somebody is there: a terminal in focus, a device that works."""
    joints: Mapping[str, float] = field(default_factory=dict)
    """Positions of a leader arm's joints, in its own units, by LeRobot's names."""
    round_trip: float = 0.0
    """From asking the device to its answer, where it is asked [s]."""


class Device(Protocol):
    """Something in a person's hand. One thread opens, reads and closes it; an error means that it is gone."""

    name: str
    """Name in the data."""

    def open(self) -> None:
        """Find it and get it ready; the error says what to do where it cannot be used."""

    def read(self) -> DeviceInput:
        """Return where its controls are, within 0.01 s."""
        ...

    def close(self) -> None:
        """Give it back, also one that is gone."""


@dataclass(frozen=True)
class StickShape:
    """Dead zone and curve: `y = sign(x) ((|x| − d) / (1 − d))^p` where |x| ≥ d, else 0."""

    dead_zone: float = 0.12
    """d, from 0 to 0.5."""
    exponent: float = 1.7
    """p, from 1 to 3."""

    def __call__(self, raw: float) -> float:
        """Return the deflection of a raw one, from −1 to 1; of NaN, 0."""
        size = min(abs(raw), 1.0)
        if not size > self.dead_zone:
            return 0.0
        curved = ((size - self.dead_zone) / (1.0 - self.dead_zone)) ** self.exponent
        return curved if raw > 0 else -curved

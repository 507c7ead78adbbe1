"""The operator's intent: values on channels, and a mask of those that are commanded."""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray, are_finite, frozen, real
from handrail.controllers.errors import HandrailError, shown
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.frames import Frames

DEAD_MAN_TIME = 0.25
"""Age from which an input or an intent is stale, and the robot brakes [s]."""
LONG_AGO = -1e6
"""Time of the intent of an operator who does not steer [s]: it is stale, and the controller brakes."""
_USUAL = Frames()
_HALF = 0.5  # a gripper command beyond it closes


@dataclass(frozen=True)
class RawInput:
    """The input device's reading, before it became a command."""

    values: FloatArray = field(default_factory=lambda: np.zeros(0))
    """Deflection of each input from −1 to 1, or a leader arm's joint angles [rad], by channel, (m,); (0,)
    if it is not known."""
    axes: int = 0  # how many inputs the operator moves now
    switches: int = 0  # how often they changed to other inputs in this episode so far
    device: str = ""  # what they moved; empty for a script or a policy
    age: float = 0.0  # of the reading when it became a command [s]
    round_trip: float = 0.0  # from what the device's screen showed to the answer, on one clock [s]

    def __post_init__(self) -> None:
        """Copy the array and make it read-only."""
        object.__setattr__(self, "values", frozen(self.values, what="raw input of an intent"))


@dataclass(frozen=True)
class Intent:
    """A partial command."""

    values: FloatArray
    """One number a channel, in the order of `Channels.names`, (m,); where the mask is false they mean
    nothing."""
    mask: BoolArray  # which channels the operator owns now, (m,)
    grippers: tuple[float, ...] = (0.0,)
    """How far each hand's is to be closed, 0 open to 1; a single number is of all of them."""
    mode: str = ""  # name of the teleop mode that made it
    time: float = 0.0
    """When the operator asked [s], on the clock of the state; every new intent has a later one."""
    frames: Frames = _USUAL  # in which frames the twists are meant, and for which point of the tool
    raw: RawInput = RawInput()  # what the input device read

    def __post_init__(self) -> None:
        """Copy the arrays and make them read-only."""
        object.__setattr__(self, "values", frozen(self.values, what="values of an intent"))
        object.__setattr__(self, "mask", frozen(self.mask, bool, "mask of an intent"))
        object.__setattr__(self, "time", real(self.time, "time of an intent"))
        grippers = frozen(self.grippers, what="grippers of an intent")
        object.__setattr__(self, "grippers", tuple(grippers.ravel().tolist()))
        if not isinstance(self.frames, Frames):
            raise HandrailError(f"frames of an intent: expected Frames, got {shown(self.frames)}")

    @classmethod
    def idle(cls, channels: Channels, time: float = 0.0) -> "Intent":
        """Return the intent of an operator who touches nothing."""
        return cls(np.zeros(channels.size), np.zeros(channels.size, dtype=bool), time=time)

    def of_hands(self, hands: int) -> "Intent":
        """Return the intent with a number for each gripper; NaN, which brakes, where some are missing."""
        if len(self.grippers) == hands:
            return self
        same = self.grippers[0] if len(self.grippers) == 1 else math.nan
        return replace(self, grippers=(same,) * hands)

    @property
    def newest(self) -> float:
        """When the last of those that ask did so [s]."""
        return self.time

    @property
    def is_finite(self) -> bool:
        """Whether every commanded value, grippers and the time are numbers, and each value has a mask."""
        scalars = all(map(math.isfinite, (*self.grippers, self.time)))
        scalars = scalars and self.values.ndim == 1 and self.values.shape == self.mask.shape
        return scalars and (are_finite(self.values) or bool(np.all(np.isfinite(self.values) | ~self.mask)))


def closed(grippers: tuple[float, ...], hands: int) -> tuple[float, ...]:
    """Return how far each of so many grippers is closed, from 0 to 1."""
    within = tuple(min(max(each, 0.0), 1.0) for each in grippers)
    return within * hands if len(within) == 1 else within


def decided_gripper(number: float) -> float:
    """Return 1 (close) for a number beyond a half, else 0 (open); NaN stays, and brakes the robot."""
    return float(number > _HALF) if math.isfinite(number) else float(number)

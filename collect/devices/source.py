"""One device with its map: what it says becomes deflections of channels, and actions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from handrail.collect.devices.control_map import HELD, ControlMap, Moves
from handrail.collect.devices.poller import Poller


@dataclass(frozen=True)
class Heard:
    """What a device says now, in the words of its map.

    Attributes:
        time: of its reading [s].
        attended: whether somebody is there.
        held: whether they hold its dead-man, where it has one of its own.
        axes: deflection by channel, none while it is not held.
        actions: asked for since the last time, in their order.
        clutch: whether the clutch is held.
        joints: positions of a leader's joints.
        round_trip: to the device and back [s].
    """

    time: float
    attended: bool
    held: bool
    axes: Mapping[str, float] = field(default_factory=dict)
    actions: tuple[str, ...] = ()
    clutch: bool = False
    joints: Mapping[str, float] = field(default_factory=dict)
    round_trip: float = 0.0


class DeviceSource:
    """A device, its thread, and its map.

    Args:
        poller: of the device; open.
        controls: what its controls mean.
    """

    def __init__(self, poller: Poller, controls: ControlMap) -> None:
        self._poller, self.controls = poller, controls
        self._bank = 0

    @property
    def name(self) -> str:
        """Of the device."""
        return self._poller.device.name

    @property
    def trouble(self) -> str:
        """Why it says nothing, and what to do."""
        return self._poller.trouble

    def bank(self, banks: Sequence[Moves]) -> Moves:
        """Return the moves in force: those of the bank that was chosen."""
        return banks[self._bank % len(banks)]

    def next_bank(self, banks: Sequence[Moves]) -> None:
        """Go on to the next bank."""
        self._bank = (self._bank + 1) % len(banks)

    def listen(self, banks: Sequence[Moves]) -> Heard | None:
        """Return what the device says now; None while it is gone.

        Args:
            banks: of its map, for what is steered now.
        """
        reading, presses = self._poller.take()
        if reading is None:
            return None
        actions = self.controls.actions
        lasting = {actions[name] for name in reading.deflections if actions.get(name) in HELD}
        held = "hold" in lasting or not self.controls.is_held
        axes: dict[str, float] = {}
        if held and reading.attended:
            for control, (axis, sign) in self.bank(banks).items():
                axes[axis] = axes.get(axis, 0.0) + sign * reading.deflections.get(control, 0.0)
        asked = (actions[name] for name in presses if name in actions)
        return Heard(
            reading.time,
            reading.attended,
            held,
            {axis: value for axis, value in axes.items() if value},
            tuple(action for action in asked if action not in HELD),
            "clutch" in lasting and reading.attended,
            reading.joints,
            reading.round_trip,
        )

    def close(self) -> None:
        """Give the device back."""
        self._poller.close()

"""Reads a device in a thread of its own, so that one that hangs never holds up the robot's loop."""

import threading
from contextlib import suppress
from typing import Self

from handrail.collect.devices.control_map import ControlMap, Moves, Steered
from handrail.collect.devices.device import Device, DeviceInput
from handrail.controllers.errors import HandrailError, message_of

_RETRY = 1.0  # between two attempts to find a device that is gone [s]
_PATIENCE = 20.0  # with its first opening [s]


class DeviceReader:
    """Keeps the newest input of a device, in the words of its map, and finds it again after it was gone.

    Args:
        device: opened, read and closed by the thread alone.
        controls: what its controls mean; nothing by default.
        retry: pause between two attempts to open it again [s].

    Attributes:
        trouble: why there is no input, and what to do.
    """

    def __init__(self, device: Device, controls: ControlMap | None = None, retry: float = _RETRY) -> None:
        self.device, self._retry = device, retry
        self.controls, self._bank = controls or ControlMap({}, {}), 0
        self._lock = threading.Lock()
        self._newest: DeviceInput | None = None
        self._presses: list[str] = []
        self.trouble = ""
        self._tried, self._ended = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"reads {device.name}", daemon=True)

    def start(self) -> Self:
        """Open the device."""
        self._thread.start()
        trouble = self.trouble if self._tried.wait(_PATIENCE) else f"{self.device.name}: does not answer"
        if trouble:
            self._ended.set()
            raise HandrailError(trouble)
        return self

    def take(self) -> tuple[DeviceInput | None, tuple[str, ...]]:
        """Return the newest input, none while the device is gone, and all presses since the last time."""
        with self._lock:
            presses, self._presses = tuple(self._presses), []
            return self._newest, presses

    def moves(self, steered: Steered) -> Moves:
        """Return the moves in force for what is steered: those of the bank that was chosen."""
        banks = self.controls.banks(steered)
        return banks[self._bank % len(banks)]

    def next_bank(self, steered: Steered) -> bool:
        """Go on to the next bank; return whether that is the first one again."""
        size = len(self.controls.banks(steered))
        self._bank = (self._bank % size + 1) % size
        return self._bank == 0

    def input(self, steered: Steered) -> tuple[DeviceInput | None, tuple[str, ...]]:
        """Return what the device says now in the words of its map, none while it is gone, and all it asks."""
        newest, presses = self.take()
        meant = self.controls.meant(newest or DeviceInput(0.0), presses, self.moves(steered))
        return meant if newest else None, meant.presses

    def close(self) -> None:
        """Give the device back."""
        self._ended.set()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        is_open = False
        while not self._ended.is_set():
            try:
                if is_new := not is_open:  # what is held then is no press, STOP is
                    self.device.open()
                    self.trouble, is_open = "", True
                    self._tried.set()
                newest = self.device.read()
                with self._lock:
                    self._newest = newest
                    self._presses += [x for x in newest.presses if x in self.controls.stops or not is_new]
            except Exception as error:  # whatever a driver raises
                self._lose(error)
                self._close()
                is_open = False
                self._tried.set()
                self._ended.wait(self._retry)
        self._close()

    def _lose(self, error: Exception) -> None:
        said = message_of(error)
        if not isinstance(error, HandrailError):
            said = f"{self.device.name}: {said}; check it and its cable, then press start"
        with self._lock:
            self._newest, self.trouble = None, said
            self._presses = [name for name in self._presses if name in self.controls.stops]

    def _close(self) -> None:
        with suppress(Exception):  # of a device that is gone anyway
            self.device.close()

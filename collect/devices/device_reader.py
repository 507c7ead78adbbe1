"""Reads a device in a thread of its own, so that one that hangs never holds up the robot's loop."""

import threading
from collections.abc import Callable, Sequence
from typing import Self

from handrail.collect.devices.control_map import ControlMap, Moves
from handrail.collect.devices.device import Device, DeviceGoneError, DeviceInput
from handrail.controllers.errors import HandrailError, message_of

_RETRY = 1.0  # between two attempts to find a device that is gone [s]
_PATIENCE = 20.0  # with its first opening [s]


class DeviceReader:
    """Keeps the newest input of a device, in the words of its map, and finds it again after it was gone.

    Args:
        device: opened, read and closed by the thread alone.
        controls: what its controls mean; nothing by default.
        retry: pause between two attempts to open it again [s].
    """

    def __init__(self, device: Device, controls: ControlMap | None = None, retry: float = _RETRY) -> None:
        self.device, self._retry = device, retry
        self.controls, self._bank = controls or ControlMap({}, {}), 0
        self._lock = threading.Lock()
        self._newest: DeviceInput | None = None
        self._presses: list[str] = []
        self.trouble = ""  # why there is no input, and what to do
        self._opened, self._ended = threading.Event(), threading.Event()
        self._refusal: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name=f"reads {device.name}", daemon=True)

    def start(self) -> Self:
        """Open the device."""
        self._thread.start()
        opened = self._opened.wait(_PATIENCE)
        if isinstance(self._refusal, HandrailError):
            raise self._refusal
        if self._refusal is not None or not opened:
            why = message_of(self._refusal) if self._refusal else "it does not answer"
            raise HandrailError(f"{self.device.name}: cannot be opened: {why}") from self._refusal
        return self

    def take(self) -> tuple[DeviceInput | None, tuple[str, ...]]:
        """Return the newest input, none while the device is gone, and all presses since the last time."""
        with self._lock:
            presses, self._presses = tuple(self._presses), []
            return self._newest, presses

    def bank(self, banks: Sequence[Moves]) -> Moves:
        """Return the moves in force: those of the bank that was chosen."""
        return banks[self._bank % len(banks)]

    def next_bank(self, banks: Sequence[Moves]) -> bool:
        """Go on to the next bank; return whether that is the first one again."""
        self._bank = (self._bank % len(banks) + 1) % len(banks)
        return self._bank == 0

    def input(self, banks: Sequence[Moves]) -> DeviceInput | None:
        """Return what the device says now in the words of its map; None while it is gone."""
        newest, presses = self.take()
        return self.controls.meant(newest, presses, self.bank(banks)) if newest else None

    def close(self) -> None:
        """Give the device back."""
        self._ended.set()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        try:
            self._attempt(self.device.open)
            self._opened.set()
            while not self._ended.is_set():
                try:
                    newest = self._attempt(self.device.read)
                except DeviceGoneError as error:
                    self._lose(error)
                    self._find_again()
                else:
                    self._keep(newest)
        except BaseException as error:
            self._refusal = error
            self._lose(error)
            self._opened.set()
        finally:
            self._close()

    def _keep(self, newest: DeviceInput) -> None:
        with self._lock:
            self._newest = newest
            self._presses += newest.presses

    def _find_again(self) -> None:
        while not self._ended.wait(self._retry):
            self._close()
            try:
                self._attempt(self.device.open)
            except DeviceGoneError as error:
                self.trouble = str(error)
            else:
                self.trouble = ""
                return

    def _lose(self, error: BaseException) -> None:
        with self._lock:
            self._newest, self.trouble = None, message_of(error)
            self._presses.clear()

    def _close(self) -> None:
        try:
            self.device.close()
        except Exception as error:  # of a device that is gone anyway
            self.trouble = self.trouble or message_of(error)

    def _attempt[Result](self, step: Callable[[], Result]) -> Result:
        """Do a step of the device; whatever a driver raises means that it is gone."""
        try:
            return step()
        except HandrailError:
            raise
        except Exception as error:
            raise DeviceGoneError(f"{self.device.name}: {message_of(error)}") from error

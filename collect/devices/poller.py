"""Reads a device in a thread of its own, so that one that hangs never holds up the robot's loop."""

import threading
from collections.abc import Callable
from typing import Self

from handrail.collect.devices.reading import Device, DeviceGoneError, Reading
from handrail.controllers.errors import HandrailError, message_of

_RETRY = 1.0  # between two attempts to find a device that is gone [s]
_PATIENCE = 20.0  # with its first opening [s]


class Poller:
    """Keeps the newest reading of a device, and finds it again after it was gone.

    Args:
        device: opened, read and closed by the thread alone.
        retry: pause between two attempts to open it again [s].
    """

    def __init__(self, device: Device, retry: float = _RETRY) -> None:
        self.device, self._retry = device, retry
        self._lock = threading.Lock()
        self._newest: Reading | None = None
        self._presses: list[str] = []
        self._trouble = ""
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

    def take(self) -> tuple[Reading | None, tuple[str, ...]]:
        """Return the newest reading, none while the device is gone, and all presses since the last time."""
        with self._lock:
            presses, self._presses = tuple(self._presses), []
            return self._newest, presses

    @property
    def trouble(self) -> str:
        """Why there is no reading, and what to do."""
        return self._trouble

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
                    self._read_on()
                except DeviceGoneError as error:
                    self._lose(error)
                    self._find_again()
        except BaseException as error:
            self._refusal = error
            self._lose(error)
            self._opened.set()
        finally:
            self._close()

    def _read_on(self) -> None:
        while not self._ended.is_set():
            reading = self._attempt(self.device.read)
            with self._lock:
                self._newest = reading
                self._presses += reading.presses

    def _find_again(self) -> None:
        while not self._ended.wait(self._retry):
            self._close()
            try:
                self._attempt(self.device.open)
            except DeviceGoneError as error:
                self._trouble = str(error)
            else:
                self._trouble = ""
                return

    def _lose(self, error: BaseException) -> None:
        with self._lock:
            self._newest, self._trouble = None, message_of(error)
            self._presses.clear()

    def _close(self) -> None:
        try:
            self.device.close()
        except Exception as error:  # of a device that is gone anyway
            self._trouble = self._trouble or message_of(error)

    def _attempt[Result](self, step: Callable[[], Result]) -> Result:
        """Do a step of the device; whatever a driver raises means that it is gone."""
        try:
            return step()
        except HandrailError:
            raise
        except Exception as error:
            raise DeviceGoneError(f"{self.device.name}: {message_of(error)}") from error

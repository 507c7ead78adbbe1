"""Play recorded input events into the real devices: SDL's virtual gamepad, HID, a terminal, a leader."""

import ctypes
import json
import sys
from pathlib import Path
from typing import Any

import pytest
from places import ROOT

from handrail.collect.devices.control_map import ControlMap
from handrail.collect.devices.device import DeviceInput
from handrail.collect.devices.device_reader import DeviceReader
from handrail.collect.devices.gamepad import AXES, BUTTONS

HID = "hidraw" if sys.platform == "linux" else "hid"  # the module that the SpaceMouse is read with
EVENTS = ROOT / "tests" / "data" / "devices"


def recorded(name: str) -> list[dict[str, Any]]:
    """Return the events of a file, in their order."""
    return json.loads((EVENTS / name).read_text())


class Clock:
    """A clock that stands until it is moved."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class VirtualPad:
    """A gamepad that SDL itself makes: everything above it is what a real pad goes through.

    One for all tests: SDL counts them on.
    """

    def __init__(self) -> None:
        pygame = pytest.importorskip("pygame", reason="the extra `devices` is not installed")
        found = sorted((Path(pygame.__file__).parent.parent / "pygame.libs").glob("libSDL2-2*"))
        if not found:
            pytest.skip("this pygame brings no SDL of its own to make a gamepad with")
        self._sdl = ctypes.CDLL(str(found[0]))
        self._sdl.SDL_JoystickOpen.restype = ctypes.c_void_p
        self._index = -1

    def plug_in(self) -> None:
        """Attach it: of the kind 'gamepad', with SDL's places of axes and buttons."""
        self._index = self._sdl.SDL_JoystickAttachVirtual(1, len(AXES), len(BUTTONS), 0)
        self._pad = ctypes.c_void_p(self._sdl.SDL_JoystickOpen(self._index))
        for name in AXES[4:]:
            self.move(name, -1.0)  # triggers rest there

    def move(self, control: str, value: float) -> None:
        """Move a stick or a trigger, as its sensor says it, or press a button."""
        if control in AXES:
            count = ctypes.c_int16(round(32767 * value))
            self._sdl.SDL_JoystickSetVirtualAxis(self._pad, AXES.index(control), count)
        else:
            pressed = ctypes.c_uint8(bool(value))
            self._sdl.SDL_JoystickSetVirtualButton(self._pad, BUTTONS.index(control), pressed)

    def unplug(self) -> None:
        """Detach it."""
        if self._index >= 0:
            self._sdl.SDL_JoystickDetachVirtual(self._index)
            self._index = -1


class PlayedHid:
    """Stands in for hidapi: one device that says recorded reports."""

    def __init__(self) -> None:
        self.reports: list[bytes] = []
        self.plugged, self.allowed, self.waits = True, True, True
        self.vendor, self.product = 0x256F, 0xC635

    def enumerate(self) -> list[dict[str, Any]]:
        found = {"vendor_id": self.vendor, "product_id": self.product, "usage_page": 1, "usage": 8}
        other = {
            "vendor_id": 0x046D,
            "product_id": 0xC077,
            "usage_page": 1,
            "usage": 2,
            "path": b"/dev/hidraw0",
        }
        return [other, *([{**found, "path": b"/dev/hidraw3"}] if self.plugged else [])]

    def device(self) -> "PlayedHid":
        return self

    def open_path(self, path: bytes) -> None:
        assert path == b"/dev/hidraw3"
        if not self.allowed:
            raise OSError("open failed")

    def set_nonblocking(self, on: int) -> None:
        self.waits = not on

    def read(self, size: int, patience: int) -> list[int]:
        assert patience or not self.waits, "hidapi would wait for the next report, however long"
        if not self.plugged:
            raise OSError("read error")
        return list(self.reports.pop(0)) if self.reports else []

    def close(self) -> None:
        pass


class PlayedTerminal:
    """A terminal that says recorded bytes."""

    def __init__(self) -> None:
        self.bytes: list[bytes] = []
        self.written = b""
        self.tells_releases = False

    def open(self) -> None:
        self.tells_releases = False

    def read(self, patience: float) -> bytes:
        return self.bytes.pop(0) if self.bytes else b""

    def write(self, data: bytes) -> None:
        self.written += data

    def tell_releases(self) -> None:
        self.tells_releases = True

    def close(self) -> None:
        pass


class PlayedReader(DeviceReader):
    """A device as its thread shows it, without the thread."""

    def __init__(self, name: str, clock: Clock, controls: ControlMap) -> None:
        self.name, self._clock = name, clock
        super().__init__(self, controls)
        self.trouble = ""
        self.gone = False
        self.values: dict[str, float] = {}
        self.presses: list[str] = []
        self.joints: dict[str, float] = {}
        self.attended = True
        self.time: float | None = None

    def take(self) -> tuple[DeviceInput | None, tuple[str, ...]]:
        presses, self.presses = tuple(self.presses), []
        if self.gone:
            return None, presses
        time = self._clock() if self.time is None else self.time
        values = {name: value for name, value in self.values.items() if value}
        return DeviceInput(time, values, presses, self.attended, dict(self.joints)), presses

    def close(self) -> None:
        self.gone = True

"""A SpaceMouse (3Dconnexion), through hidapi: six axes that spring back, and buttons."""

import struct
import sys
import time
from collections.abc import Callable
from typing import Any

from handrail.collect.devices.device import DeviceInput, StickShape
from handrail.controllers.errors import HandrailError, imported

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
_OWN = (*AXES, *(f"button_{number}" for number in range(1, 33)))
_OTHER = "second_"  # the controls of another one are named so
CONTROLS = (*_OWN, *(_OTHER + name for name in _OWN))
_OF_DEVICE = (1, 0, 2, 4, 3, 5)  # forward, left, up, and the turns about them: among right, backward, down
_FULL = 350.0  # of an axis, as the device counts
_MOST = 2.0  # times that no device says
_SILENCE = 0.15  # a cap that is deflected speaks more often than that [s]
_TRANSLATION, _ROTATION, _BUTTONS = 1, 2, 3  # the kinds of reports
_VENDOR, _FORMER_VENDOR = 0x256F, 0x046D  # 3Dconnexion; Logitech, which sold the older ones
_FORMER = range(0xC603, 0xC62C)  # products
_RULE = 'KERNEL=="hidraw*", ATTRS{idVendor}=="256f", MODE="0660", TAG+="uaccess"'
_WAIT = 8  # for a report [ms]
_MOST_REPORTS = 32  # taken at once


class SpaceMouse:
    """A SpaceMouse; a device. Its cap springs back when let go, and says so: that is its dead-man.

    The device counts to the right, backward and down; its axes here are forward, left and up, as the
    robot's, and the turns about them. A cap that is deflected speaks all the time: one that falls silent
    counts as left alone.

    Args:
        shape: of its axes.
        clock: of readings [s].
        number: of those that are plugged in, from 0.
    """

    name = "spacemouse"

    def __init__(
        self, shape: StickShape | None = None, clock: Callable[[], float] = time.monotonic, number: int = 0
    ) -> None:
        self._shape, self._clock, self._number = shape or StickShape(), clock, number
        self._hid: Any = None

    def open(self) -> None:
        """Find a SpaceMouse."""
        hid, found = _plugged()
        if len(found) <= self._number:
            raise HandrailError(f"SpaceMouse: expected one{' more' * self._number}, found none; plug it in")
        self._axes: dict[str, float] = dict.fromkeys(AXES, 0.0)
        self._down: frozenset[str] = frozenset()
        self._heard = 0.0
        self._hid = hid.device()
        try:
            self._hid.open_path(found[self._number])
        except OSError as error:
            where = found[self._number].decode(errors="replace")
            raise HandrailError(
                f"SpaceMouse: {where} may not be read; put the line {_RULE} "
                "into /etc/udev/rules.d/70-spacemouse.rules, plug it in again"
            ) from error
        self._hid.set_nonblocking(1)  # or a patience of 0 would wait for the next report

    def read(self, most: int = _MOST_REPORTS) -> DeviceInput:
        """Return its axes and buttons, with so many new reports at most."""
        presses: list[str] = []
        for number in range(most):
            report = self._hid.read(64, 0 if number else _WAIT)
            presses += self._take(bytes(report)) if report else []
            if presses or not report:  # what was pressed is said before a reading that may fail
                break
        now = self._clock()
        silent = any(self._axes.values()) and now - self._heard > _SILENCE
        held = {name: value for name, value in self._axes.items() if value} | dict.fromkeys(self._down, 1.0)
        return DeviceInput(self._heard if silent else now, held, tuple(presses), attended=not silent)

    def close(self) -> None:
        """Give it back."""
        if self._hid:
            self._hid.close()
        self._hid = None

    def _take(self, report: bytes) -> list[str]:
        """Take a report; return the buttons that it says went down."""
        kind, data = report[0], report[1:]
        if kind == _BUTTONS and data:
            bits, before = int.from_bytes(data[:4], "little"), self._down
            self._down = frozenset(f"button_{index + 1}" for index in range(32) if bits >> index & 1)
            return sorted(self._down - before)
        of_translation = AXES if len(data) >= 12 else AXES[:3]
        names = {_TRANSLATION: of_translation, _ROTATION: AXES[3:]}.get(kind, ())
        whole = names and len(data) >= 2 * len(names)
        counts = struct.unpack_from(f"<{len(names)}h", data) if whole else ()
        if not counts or max(map(abs, counts)) > _MOST * _FULL:
            return []
        for name, at in zip(names, _OF_DEVICE, strict=False):
            self._axes[name] = self._shape(-counts[at] / _FULL)
        self._heard = self._clock()
        return []


class SpaceMice:
    """One SpaceMouse, or two as one device, a hand each: in doubt of one, both are left alone.

    Args:
        shape: of their axes.
        clock: of readings [s].
    """

    name = "spacemouse"

    def __init__(self, shape: StickShape | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._caps = [SpaceMouse(shape, clock, number) for number in range(2)]
        self._open = self._caps[:1]

    def open(self) -> None:
        """Find one or two, in the order of their addresses; two stay two, or one would steer another hand."""
        self._open = self._caps[: max(len(self._open), len(_plugged()[1]))]
        for cap in self._open:
            cap.open()

    def read(self) -> DeviceInput:
        """Return the axes and buttons of both."""
        one = self._open[0].read()
        for cap in self._open[1:]:
            each = cap.read(0 if one.presses else _MOST_REPORTS)  # which may fail: a press is said before
            moved = {_OTHER + name: value for name, value in each.deflections.items()}
            presses = (*one.presses, *(_OTHER + name for name in each.presses))
            time, attended = min(one.time, each.time), one.attended and each.attended
            one = DeviceInput(time, {**one.deflections, **moved}, presses, attended=attended)
        return one

    def close(self) -> None:
        """Give them back."""
        for cap in self._open:
            cap.close()


def _plugged() -> tuple[Any, list[bytes]]:
    """Return hidapi, and the addresses of those that are plugged in."""
    module = "hidraw" if sys.platform == "linux" else "hid"  # on Linux `hid` is libusb: the rule cannot help
    hid = imported(module, "--operator spacemouse", "hidapi", "devices")
    return hid, sorted({each["path"] for each in hid.enumerate() if _is_one(each)})


def _is_one(device: dict[str, Any]) -> bool:
    """Whether a HID device is a SpaceMouse's axes and buttons, which are a 'multi-axis controller'."""
    vendor, product = device["vendor_id"], device["product_id"]
    page = device.get("usage_page", 0), device.get("usage", 0)
    ours = vendor == _VENDOR or (vendor == _FORMER_VENDOR and product in _FORMER)
    return ours and page in ((1, 8), (0, 0))

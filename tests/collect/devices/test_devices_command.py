"""`handrail-devices` says which devices there are, what is missing where one is not, and what one says."""

import time

import pytest
from command_helpers import ran

from handrail.collect.commands import devices
from handrail.collect.devices.device import DeviceInput
from handrail.controllers.errors import HandrailError


class Lever:
    """A device that is plugged in and pushed halfway, or one that is not there."""

    def __init__(self, name, trouble=""):
        self.name, self._trouble = name, trouble

    def open(self):
        if isinstance(self._trouble, Exception):
            raise self._trouble
        if self._trouble:
            raise HandrailError(f"{self.name}: {self._trouble}")

    def read(self):
        time.sleep(0.001)
        return DeviceInput(0.0, {"x": 0.5})

    def close(self):
        pass


@pytest.fixture(autouse=True)
def _plugged_in(monkeypatch):
    monkeypatch.setattr(devices, "Gamepad", lambda *_: Lever("gamepad"))
    monkeypatch.setattr(devices, "SpaceMouse", lambda *_: Lever("spacemouse", "plug one in"))


def test_present_devices_are_ready_and_others_get_advice():
    shown = " ".join(ran(name="devices list").split())
    assert "gamepad ready spacemouse plug one in keyboard " in shown
    assert "leader_arm serial ports: " in shown
    assert "so101_leader" in shown


def test_what_a_driver_raises_is_said_in_its_row(monkeypatch):
    monkeypatch.setattr(devices, "Gamepad", lambda *_: Lever("gamepad", OSError("x11 not available")))
    assert "gamepad x11 not available spacemouse plug one in" in " ".join(ran(name="devices list").split())


def test_readings_of_a_device_are_shown_line_by_line():
    lines = ran("gamepad", "--seconds", 0.3, name="devices test").splitlines()
    assert len(lines) == 3
    assert lines[-1] == "x +0.50"

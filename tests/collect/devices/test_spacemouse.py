"""Laws of the SpaceMouse: its axes as the robot's, silence and garbage move nothing, why there is none."""

import sys
from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest
from device_players import HID, PlayedHid, PlayedTerminal, recorded
from driven_person import MODEL

from handrail.collect.config import RecordConfig
from handrail.collect.devices.keyboard import Keyboard
from handrail.collect.devices.open_devices import open_device
from handrail.collect.devices.spacemouse import SpaceMice, SpaceMouse
from handrail.collect.operators.modes import MODES
from handrail.collect.teleop_config import TeleopConfig
from handrail.controllers.errors import HandrailError
from handrail.controllers.registry import fitting

FORWARD = bytes.fromhex("010000a2fe0000")  # y = −350, and it counts backward


@pytest.fixture
def played(monkeypatch):
    made = PlayedHid()
    monkeypatch.setitem(sys.modules, HID, made)
    return made


@pytest.fixture
def mouse(played, clock):
    made = SpaceMouse(clock=clock)
    made.open()
    return made


def test_recorded_reports_come_out_on_the_robots_axes(played, clock, mouse):
    at, start = {}, clock.now
    for event in recorded("spacemouse.json"):
        clock.now = start + event["time"]
        played.reports = [bytes.fromhex(event["report"])]
        at[event["time"]] = mouse.read()
    assert at[0.064].deflections["x"] == 1.0
    assert "y" not in at[0.064].deflections  # the small ones are within the dead zone
    assert at[0.156].deflections.keys() == {"x", "yaw"}
    assert 0.3 < at[0.156].deflections["yaw"] < 0.6  # to the left is positive
    assert at[0.208].deflections == {}
    assert at[0.25].presses == ("button_1",)
    assert at[0.3].presses == ()
    assert at[0.35].presses == ("button_2",)
    assert at[0.5].deflections == {}
    assert at[0.6].deflections == {"y": 1.0}


def test_one_that_falls_silent_while_it_is_deflected_is_left_alone(played, clock, mouse):
    played.reports = [FORWARD]
    assert mouse.read().attended
    began = clock.now
    clock.now += 0.14
    assert mouse.read().attended
    clock.now += 0.02
    silent = mouse.read()
    assert not silent.attended
    assert silent.time == began
    played.reports = [bytes(7)[:0] + bytes.fromhex("01000000000000")]
    assert mouse.read().attended
    clock.now += 100.0  # at rest it has nothing to say
    assert mouse.read().attended
    assert mouse.read().time == clock.now


def test_garbage_alone_is_silence(played, clock, mouse):
    played.reports = [FORWARD]
    mouse.read()
    for _ in range(20):
        clock.now += 0.01
        played.reports = [b"\x01\xff\x7f\xff\x7f\xff\x7f", b"\xfe" * 40, b"\x02\x00"]
        reading = mouse.read()
    assert not reading.attended


def test_unplugged_it_is_gone_and_says_what_to_do(played, mouse):
    played.plugged = False
    with pytest.raises(OSError, match="read error"):
        mouse.read()
    with pytest.raises(HandrailError, match="expected one, found none; plug it in"):
        mouse.open()


def test_of_two_one_that_is_unplugged_is_waited_for(played, monkeypatch):
    """The other one would steer its hand."""
    found, paths = played.enumerate()[1], ["3", "5"]
    monkeypatch.setattr(played, "enumerate", lambda: [{**found, "path": each.encode()} for each in paths])
    monkeypatch.setattr(played, "open_path", lambda path: None)
    mice = SpaceMice()
    for path in ("3", "5"):
        mice.open()
        mice.close()
        paths.remove(path)
        with pytest.raises(HandrailError, match="expected one more, found none; plug it in"):
            mice.open()
        paths.insert(path == "5", path)


def test_a_press_before_it_was_unplugged_is_said(played, mouse):
    """Both are waiting when it is read."""

    def read(size, patience):
        if not played.reports:
            raise OSError("read error")
        return list(played.reports.pop(0))

    played.reports, played.read = [b"\x03\x01\x00"], read
    assert mouse.read().presses == ("button_1",)
    with pytest.raises(OSError, match="read error"):
        mouse.read()


def test_one_that_may_not_be_read_says_the_rule(played):
    played.allowed = False
    with pytest.raises(HandrailError) as error:
        SpaceMouse().open()
    for words in ("/dev/hidraw3 may not be read", "/etc/udev/rules.d/", 'ATTRS{idVendor}=="256f"', "uaccess"):
        assert words in str(error.value)


def test_an_older_one_of_another_vendor_is_known_and_its_mice_are_not(played):
    played.vendor, played.product = 0x046D, 0xC626
    SpaceMouse().open()
    played.product = 0xC077
    with pytest.raises(HandrailError):
        SpaceMouse().open()


def test_received_bytes_are_read_without_waiting_for_more(played, mouse):
    """hidapi takes a patience of 0 for none given: unless told otherwise, it waits for the next report."""
    played.reports = [FORWARD]
    assert mouse.read().deflections == {"x": 1.0}


@pytest.mark.parametrize(
    ("system", "module", "other"), [("linux", "hidraw", "hid"), ("darwin", "hid", "hidraw")]
)
def test_on_linux_it_is_read_by_hidraw_whose_files_the_rule_opens(monkeypatch, system, module, other):
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setitem(sys.modules, module, PlayedHid())
    monkeypatch.setitem(sys.modules, other, None)
    SpaceMouse().open()


def test_without_hidapi_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, HID, None)
    with pytest.raises(HandrailError, match=r"expected hidapi, found none; .*\[devices\]"):
        SpaceMouse().open()


@pytest.mark.parametrize(
    ("operator", "actions", "missing"),
    [
        ("spacemouse", "", "start"),  # and without a terminal nothing else could say it
        ("keyboard", 'enter = ""', "start"),
        ("keyboard", 'space = "grip"', "stop"),
    ],
)
def test_devices_that_cannot_begin_or_stop_are_refused(
    played, tmp_path, monkeypatch, operator, actions, missing
):
    keyboard = partial(Keyboard, PlayedTerminal())
    monkeypatch.setattr("handrail.collect.devices.open_devices.Keyboard", keyboard)
    monkeypatch.setattr("handrail.collect.devices.open_devices.has_terminal", lambda: False)
    (tmp_path / "mine.toml").write_text(f"[actions]\n{actions}\n")
    teleop = TeleopConfig(map=str(tmp_path / "mine.toml"))
    config = RecordConfig(task="reach", mode="ee", operator=operator, teleop=teleop)
    env: Any = SimpleNamespace(model=MODEL)
    with pytest.raises(HandrailError, match=f"^{operator}: no control to {missing}; use a ter"):
        open_device(config, env, print, fitting(MODES, 1))

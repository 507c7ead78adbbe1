"""Laws of the gamepad, on one that SDL itself makes: what it says, that it is gone, why there is none."""

import sys

import pytest
from device_players import Clock, recorded

from handrail.collect.devices import gamepad
from handrail.collect.devices.gamepad import Gamepad
from handrail.controllers.errors import HandrailError


@pytest.fixture
def opened(pad):
    made = Gamepad(clock=Clock())
    made.open()
    made.read()
    yield made
    made.close()


def test_recorded_events_come_out_as_deflections_and_presses(pad, opened):
    at = {}
    for event in recorded("gamepad.json"):
        pad.move(event["control"], event["value"])
        reading = opened.read()
        at[event["time"]] = {k: round(v, 2) for k, v in reading.deflections.items()}, reading.presses
    assert at[0.0] == ({}, ())  # a worn stick
    assert at[0.2] == ({"left_shoulder": 1.0}, ("left_shoulder",))
    assert at[0.35][0] == {"left_shoulder": 1.0}
    assert at[0.5][0] == {"left_shoulder": 1.0, "left_y": -1.0}
    assert -1.0 < at[0.45][0]["left_y"] < at[0.4][0]["left_y"] < 0.0
    assert at[1.05][0]["right_trigger"] == 1.0
    assert at[1.3][0] == {"left_shoulder": 1.0}
    assert at[1.4][1] == ("a",)
    assert at[1.48][1] == ()
    assert at[1.7][0].keys() == {"right_x"}
    assert at[2.0][1] == ("start",)
    assert at[2.1][1] == ("b",)


def test_unplugged_it_is_gone_and_says_what_to_do(pad, opened):
    pad.move("left_y", -1.0)
    assert opened.read().deflections
    pad.unplug()
    with pytest.raises(HandrailError, match="plug it in again"):
        opened.read()
    pad.plug_in()
    opened.close()
    opened.open()
    assert not opened.read().deflections


def test_a_trigger_that_trembles_is_pressed_once(pad, opened):
    """Around its dead zone, and around where it is let go."""
    presses = []
    for way in (0.13, 0.11, 0.13, 0.23, 0.19, 0.23, 1.0, 0.13, 0.18, 0.13, 0.11, 0.18, 0.0, 0.3):
        pad.move("right_trigger", 2.0 * way - 1.0)  # as its sensor says it
        presses += opened.read().presses
    assert presses == ["right_trigger"] * 2


def test_without_one_it_says_what_to_do(pad):
    pad.unplug()
    with pytest.raises(HandrailError, match="expected one, found none; plug it in"):
        Gamepad().open()


def test_one_that_may_not_be_read_says_which_group(pad, tmp_path, monkeypatch):
    class Closed:
        def __init__(self, path):
            pass

        def glob(self, pattern):
            return [tmp_path / "js0"]

    pad.unplug()
    monkeypatch.setattr(gamepad, "Path", Closed)
    with pytest.raises(HandrailError, match=r"js0 may not be read; .* usermod -aG input"):
        Gamepad().open()


def test_without_pygame_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(HandrailError, match=r"expected pygame, found none; .*\[devices\]"):
        Gamepad().open()

"""Laws of a person at this computer who steers a robot with two hands: which control moves which hand."""

import sys
from copy import copy

import numpy as np
import pytest
from device_players import HID, PlayedHid
from driven_person import CONTROLS, FORWARD, Driven

from handrail.collect.devices.control_map import Steered, load_map
from handrail.collect.devices.spacemouse import SpaceMice
from handrail.collect.operators.person.inputs import Ask
from handrail.controllers.robot.model import load_model

MODEL = load_model("tiago_pro")
OTHER = {"gamepad": "a", "spacemouse": "button_2", "keyboard": "/"}
GRIPS = {"gamepad": ("left_trigger", "right_trigger"), "keyboard": ("n", "m")}


@pytest.fixture(params=FORWARD)
def driven(request):
    made = Driven(request.param, model=MODEL)
    made.begin()
    return made


def own(driven, *groups):
    channels = driven.person.meaning.channels
    driven.person.ask(Ask("mask", tuple(np.flatnonzero(channels.mask(*groups)).tolist())))


def moved(driven, **controls):
    """Return the channels that some controls move, one after the other."""
    found = []
    for control, value in controls.items():
        driven.main.values[control] = float(value)
        intent = driven.act()
        found.append({driven.person.meaning.channels.names[n] for n in np.flatnonzero(intent.raw.values)})
        del driven.main.values[control]
        driven.act()
    return found


def test_a_control_goes_to_the_other_hand(driven):
    device = driven.main.name
    (control, value) = FORWARD[device]
    for hand in ("left", "right", "left"):
        assert moved(driven, **{control: value}) == [{f"{hand}.vx"}]
        assert f"active hand {hand}" in driven.shown()
        driven.main.presses = [OTHER[device]]
        driven.act()


@pytest.mark.parametrize("device", GRIPS)
def test_each_gripper_has_a_control_of_its_own(device):
    driven = Driven(device, model=MODEL)
    driven.begin()
    for control, grippers in zip(GRIPS[device] * 2, [(1, 0), (1, 1), (0, 1), (0, 0)], strict=True):
        driven.main.presses = [control]
        assert driven.act().grippers == grippers


def test_a_control_that_moves_something_asks_for_nothing_but_the_stop():
    driven = Driven("gamepad", model=MODEL)
    driven.begin()
    own(driven, "base", "left")
    driven.main.presses, driven.main.values["left_trigger"] = ["left_trigger"], 1.0  # lowers the hand there
    intent = driven.act()
    assert intent.grippers == (0.0, 0.0)
    assert intent.raw.values.any()
    table = load_map("gamepad", CONTROLS["gamepad"])
    stop = table.meant(driven.main.input(Steered(True, False))[0], ["b"], {"b": ("ee.vx", 1)})
    assert stop.presses == ("stop",)


def test_two_hands_at_once_have_a_stick_or_keys_each():
    driven = Driven("gamepad", model=MODEL)
    driven.begin()
    own(driven, "ee")
    sticks = {"left_x": -1, "left_y": -1, "right_x": -1, "right_y": -1}
    assert moved(driven, **sticks) == [{"left.vy"}, {"left.vx"}, {"right.vy"}, {"right.vx"}]
    driven.main.presses = ["right_stick"]
    driven.act()
    assert moved(driven, **sticks) == [{"left.wz"}, {"left.vz"}, {"right.wz"}, {"right.vz"}]
    keys = Driven("keyboard", model=MODEL)
    keys.begin()
    own(keys, "ee")
    assert moved(keys, w=1, i=1, r=1, u=1, q=1) == [
        {"left.vx"}, {"right.vx"}, {"left.vz"}, {"right.vz"}, {"left.wz"},
    ]  # fmt: skip


@pytest.mark.parametrize("device", ["gamepad", "keyboard"])
def test_a_pair_is_moved_as_one_hand_and_parted(device):
    driven = Driven(device, model=MODEL)
    driven.begin()
    own(driven, "pair", "apart")
    control, value = FORWARD[device]
    assert moved(driven, **{control: value}) == [{"pair.vx"}]
    for _ in range(2 if device == "gamepad" else 0):
        driven.main.presses = ["right_stick"]
        driven.act()
    control = "right_y" if device == "gamepad" else "9"
    driven.main.values[control] = 1.0
    assert driven.act().values[driven.person.meaning.channels.names.index("apart.v")] < 0.0
    assert "apart" in driven.shown()


FORWARD_CAP = bytes.fromhex("010000a2fe0000")  # y = −350, and it counts backward


class TwoHids:
    """Stands in for hidapi with two SpaceMice, whose order in the list changes."""

    def __init__(self):
        self.caps = {b"/dev/hidraw3": PlayedHid(), b"/dev/hidraw5": PlayedHid()}

    def enumerate(self):
        known = next(iter(self.caps.values())).enumerate()[-1]
        return [{**known, "path": path} for path, cap in reversed(self.caps.items()) if cap.plugged]

    def device(self):
        return copy(self)

    def open_path(self, path):
        self.read, self.set_nonblocking = self.caps[path].read, self.caps[path].set_nonblocking

    def close(self):
        pass


@pytest.fixture
def mice(monkeypatch, clock):
    module = TwoHids()
    monkeypatch.setitem(sys.modules, HID, module)
    made = SpaceMice(clock=clock)
    made.open()
    return made, list(module.caps.values())


def test_two_caps_are_two_hands(mice):
    made, caps = mice
    table = load_map("spacemouse", CONTROLS["spacemouse"], hands=2)
    (moves, *_) = table.banks(Steered(True, False, hands=True))
    for cap, axis in zip(caps, ("one.vx", "two.vx"), strict=True):
        cap.reports = [FORWARD_CAP]
        meant = table.meant(made.read(), (), moves).deflections
        assert meant[axis] == 1.0
        cap.reports = [bytes.fromhex("01000000000000")]
        made.read()


@pytest.mark.parametrize("silent", [0, 1])
def test_one_cap_that_falls_silent_or_is_gone_is_doubt_of_both(mice, clock, silent):
    made, caps = mice
    caps[silent].reports = [FORWARD_CAP]
    began = clock.now
    assert made.read().attended
    clock.now += 0.2
    caps[1 - silent].reports = [FORWARD_CAP]
    said = made.read()
    assert not said.attended
    assert said.time == began
    caps[silent].plugged = False
    with pytest.raises(OSError, match="read error"):
        made.read()


def test_a_press_on_the_first_cap_is_said_though_the_second_is_gone(mice):
    """As of one cap; what the second one said before holds until it is asked again."""
    made, caps = mice
    caps[1].reports = [FORWARD_CAP]
    held = made.read().deflections
    caps[0].reports, caps[1].plugged = [bytes.fromhex("0301000000")], False
    said = made.read()
    assert said.presses == ("button_1",)
    assert held.items() <= said.deflections.items()
    with pytest.raises(OSError, match="read error"):
        made.read()

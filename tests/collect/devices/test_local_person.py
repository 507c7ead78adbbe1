"""Laws of a person at this computer: hold to move, brake at any doubt, start anew only after a release."""

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from device_players import PlayedTerminal
from driven_person import CHANNELS, FORWARD, MODEL, START, Driven

from handrail.collect.config import RecordConfig
from handrail.collect.devices import gamepad, open_devices
from handrail.collect.devices.device import StickShape
from handrail.collect.devices.device_reader import DeviceReader
from handrail.collect.devices.keyboard import Keyboard
from handrail.collect.devices.open_devices import open_device
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.operators.person.inputs import Ask
from handrail.collect.operators.person.person import Phase
from handrail.collect.teleop_config import TeleopConfig
from handrail.controllers.interface.intent import Intent
from handrail.controllers.registry import fitting

MODES_OF_ONE = list(fitting(MODES, 1))


@pytest.mark.parametrize("device", FORWARD)
def test_forward_is_forward_in_the_robots_own_frame(device):
    driven = Driven(device)
    driven.q[2] = np.pi / 2
    driven.begin()
    driven.push()
    intent = driven.act()
    assert intent.values[CHANNELS.hand_slice()][:3] == pytest.approx([0.0, 0.21, 0.0], abs=1e-9)
    assert np.array_equal(intent.mask, CHANNELS.mask("ee"))
    assert intent.raw.device == device


@pytest.mark.parametrize("device", FORWARD)
@pytest.mark.parametrize("mode", MODES_OF_ONE)
def test_every_mode_can_be_driven(device, mode):
    """In the bank that comes first, something moves, and only what the mode owns."""
    driven = Driven(device, mode)
    driven.begin()
    for control in ("left_x", "left_y", "x", "y", "w", "i", "1"):
        driven.main.values[control] = 1.0
    intent = driven.act()
    assert intent.values.any()
    assert not intent.values[~intent.mask].any()
    assert intent.mode == mode


@pytest.mark.parametrize("device", FORWARD)
@pytest.mark.parametrize("trouble", ["left alone", "hangs", "gone"])
def test_any_doubt_brakes_and_it_goes_on_only_after_a_release(device, trouble):
    driven = Driven(device)
    driven.begin()
    driven.push()
    assert driven.act().values.any()
    began = driven.clock.now
    if trouble == "left alone":
        driven.main.attended = False
    elif trouble == "hangs":
        driven.main.time = driven.clock.now
    else:
        driven.main.gone = True
    while (answer := driven.act()) is not EpisodeEvent.PAUSE:
        assert isinstance(answer, Intent)
    assert driven.clock.now - began <= 0.3 + 1e-9
    driven.main.attended, driven.main.time, driven.main.gone = True, None, False
    assert driven.act() is EpisodeEvent.PAUSE  # still pushed
    driven.push(0.0)
    if trouble == "gone":
        assert driven.act() is EpisodeEvent.PAUSE  # whoever comes back has to start
        driven.person.ask(Ask("start"))
    assert not driven.act().values.any()
    driven.push()
    assert driven.act().values.any()


def test_a_gamepad_moves_only_while_its_shoulder_is_held():
    driven = Driven("gamepad")
    driven.begin()
    driven.push()
    assert driven.act().values.any()
    driven.hold(False)
    assert driven.act() is EpisodeEvent.PAUSE
    driven.hold()
    assert driven.act() is EpisodeEvent.PAUSE  # the stick was not let go
    driven.push(0.0)
    assert not driven.act().values.any()
    driven.push()
    assert driven.act().values.any()


@pytest.mark.parametrize(
    ("key", "event"),
    [
        ("right", EpisodeEvent.SUCCESS),
        ("left", EpisodeEvent.RESTART),
        ("down", EpisodeEvent.FAILURE),
        ("backspace", EpisodeEvent.DISCARD),
        ("`", EpisodeEvent.UNDO),
        ("p", EpisodeEvent.PAUSE),
    ],
)
@pytest.mark.parametrize("device", FORWARD)
def test_the_terminals_keys_end_episodes_beside_every_device(device, key, event):
    driven = Driven(device, beside="" if device == "keyboard" else "keyboard")
    driven.begin()
    (driven.beside or driven.main).presses = [key]
    assert driven.act() is event


def test_keys_beside_a_gamepad_move_nothing():
    driven = Driven("gamepad", beside="keyboard")
    driven.begin()
    driven.beside.values["w"] = 1.0
    assert not driven.act().values.any()
    driven.push()
    assert driven.act().values.any()


def test_a_gamepad_has_the_terminal_s_keys_beside_it(monkeypatch):
    """They move nothing; the sticks have the shape that is asked for."""
    opened, shapes = {}, []

    class Reader(DeviceReader):
        def start(self):
            opened[self.device.name] = self

    monkeypatch.setattr(open_devices, "DeviceReader", Reader)
    monkeypatch.setattr(open_devices, "Gamepad", lambda shape: shapes.append(shape) or gamepad.Gamepad(shape))
    monkeypatch.setattr(open_devices, "has_terminal", lambda: True)
    teleop = TeleopConfig(dead_zone=0.3, exponent=2.5)
    config = RecordConfig(task="reach", mode="ee", operator="gamepad", teleop=teleop)
    env: Any = SimpleNamespace(model=MODEL)
    open_device(config, env, print, fitting(MODES, 1))
    assert list(opened) == ["gamepad", "keyboard"]
    assert opened["gamepad"].controls.moves
    assert not opened["keyboard"].controls.moves
    assert opened["keyboard"].controls.actions
    assert shapes[0] == StickShape(0.3, 2.5)


@pytest.mark.parametrize("device", START)
def test_the_stop_and_its_release(device):
    driven = Driven(device)
    driven.begin()
    driven.push()
    driven.main.presses = ["b" if device == "gamepad" else "space"]
    assert driven.act() is EpisodeEvent.PAUSE
    assert driven.person.phase is Phase.STOPPED
    assert "STOPPED" in driven.shown()
    driven.push(0.0)
    driven.main.presses = [START[device]]
    assert driven.act() is EpisodeEvent.PAUSE
    assert driven.person.phase is Phase.PAUSED
    driven.main.presses = [START[device]]
    assert isinstance(driven.act(), Intent)


@pytest.mark.parametrize(
    ("pad", "keys"), [(["b"], ["enter", "enter"]), (["b"], ["enter"]), (["b", "start"], [])]
)
def test_what_is_heard_with_a_stop_does_not_undo_it(pad, keys):
    """It may have been pressed before it: devices are heard one after the other, buttons in their order."""
    driven = Driven("gamepad", beside="keyboard")
    driven.begin()
    driven.main.presses, driven.beside.presses = list(pad), list(keys)
    assert driven.act() is EpisodeEvent.PAUSE
    assert driven.person.phase is Phase.STOPPED
    driven.person.ask(Ask("stop", False))
    driven.main.presses, driven.beside.presses = list(pad), list(keys)
    assert driven.local.between() is EpisodeEvent.PAUSE


def test_an_episode_that_is_judged_with_a_stop_is_over():
    driven = Driven("gamepad", beside="keyboard")
    driven.begin()
    driven.main.presses, driven.beside.presses = ["b"], ["right"]
    assert driven.act() is EpisodeEvent.SUCCESS
    assert driven.person.phase is Phase.STOPPED


@pytest.mark.parametrize("beside", ["", "keyboard"])
def test_a_stop_is_heard_though_its_device_is_gone_since(beside):
    driven = Driven("gamepad", beside=beside)
    driven.begin()
    device = driven.beside or driven.main
    device.presses, device.gone = ["space" if beside else "b"], True
    assert driven.act() is EpisodeEvent.PAUSE
    assert driven.person.phase is Phase.STOPPED
    driven.local.reset(driven.view(), np.random.default_rng(0))
    device.gone = False
    driven.person.ask(Ask("start"))
    assert driven.act() is EpisodeEvent.PAUSE


def test_choices_while_driving():
    driven = Driven("keyboard", "switching")
    driven.begin()
    driven.main.presses = ["tab", "=", "=", ".", "y"]
    intent = driven.act()
    setting = driven.person.setting
    assert (setting.focus, setting.speed, setting.frame) == ("base", 1.0, "tool")
    assert intent.grippers == (1.0,)
    assert np.array_equal(intent.mask, CHANNELS.mask("base"))
    driven.main.presses = ["]"]
    assert driven.act().mode == MODES_OF_ONE[MODES_OF_ONE.index("switching") + 1]
    driven.main.presses = ["[", "[", "-", "h"]
    assert driven.act().mode == MODES_OF_ONE[MODES_OF_ONE.index("switching") - 1]
    assert driven.person.setting.speed == 0.8


def test_a_gamepad_goes_from_joints_to_joints_and_the_base():
    driven = Driven("gamepad", "direct")
    driven.begin()
    seen = []
    for _ in range(4):
        driven.main.values["left_x"] = 1.0
        seen.append(tuple(np.flatnonzero(driven.act().values[CHANNELS.joint_slice])))
        driven.main.values["left_x"] = 0.0
        driven.main.presses = ["right_stick"]
        driven.act()
    assert seen[0] == (3,)
    assert seen[1] == (7,)
    assert set(seen[2]) <= {0, 1}
    assert seen[3] == seen[0]


def test_one_axis_at_a_time_and_another_one_is_a_switch():
    driven = Driven("keyboard", "direct_single")
    driven.begin()
    driven.main.values["i"] = 1.0
    first = driven.act()
    driven.main.values["1"] = 1.0
    both = driven.act()
    driven.main.values["i"] = 0.0
    second = driven.act()
    assert [int(np.flatnonzero(intent.mask)[0]) for intent in (first, both, second)] == [0, 0, 12]
    assert all(intent.mask.sum() == np.count_nonzero(intent.values) == 1 for intent in (first, both, second))
    assert [intent.raw.switches for intent in (first, both, second)] == [0, 0, 1]


def test_the_age_is_the_readings_own():
    driven = Driven("keyboard")
    driven.begin()
    driven.main.time = driven.clock.now - 0.01
    assert driven.act(0.05).raw.age == pytest.approx(0.06)


def test_the_way_that_the_card_shows_leads_to_the_goal():
    """Going along what it says, on the axes of the frame it names, brings the hand there."""
    driven = Driven("keyboard")
    driven.q[2] = 0.7
    driven.act()
    line = next(line for line in driven.shown().splitlines() if "to the goal" in line)
    way = np.array([float(number) for number in re.findall(r"[+-]\d\.\d+", line)[:3]])
    turn = np.array([[np.cos(0.7), -np.sin(0.7), 0.0], [np.sin(0.7), np.cos(0.7), 0.0], [0.0, 0.0, 1.0]])
    assert MODEL.pose(driven.q).position + turn @ way == pytest.approx([1.0, 0.0, 1.0], abs=0.02)


@pytest.mark.parametrize(
    ("policy", "actions", "asks"),
    [
        ((), 'b = "stop"', False),
        (("some",), 'b = "stop"', True),
        (("some",), 'b = "stop"\nv = "hold"', False),  # a key that is held says it, too
    ],
)
def test_the_keys_know_which_stop_and_whether_a_policy_drives(tmp_path, monkeypatch, policy, actions, asks):
    """Of a person's own table."""
    made = []

    def keyboard(**settings):
        made.append(Keyboard(PlayedTerminal(), **settings))
        return made[-1]

    for name in ("TMUX", "STY", "ZELLIJ"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("handrail.collect.devices.open_devices.Keyboard", keyboard)
    (tmp_path / "mine.toml").write_text(f"[actions]\n{actions}\n")
    teleop = TeleopConfig(map=str(tmp_path / "mine.toml"))
    config = RecordConfig(task="reach", mode="ee", operator="keyboard", policy=policy, teleop=teleop)
    env: Any = SimpleNamespace(model=MODEL)
    open_device(config, env, print, fitting(MODES, 1)).close()
    assert [(keys.stops, keys.supervises) for keys in made] == [({"space", "b"}, asks)]

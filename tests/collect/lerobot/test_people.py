"""People steer LeRobot's robot: at the cockpit's page, or with a gamepad of SDL's; who lets go, brakes."""

import json
import time
from itertools import count
from types import SimpleNamespace

import pytest
from cockpit_helpers import drive, page, told

from handrail.collect.devices import open_devices
from handrail.collect.devices.local_person import choice_of
from handrail.collect.lerobot import (
    HandrailCockpit,
    HandrailCockpitConfig,
    HandrailGamepad,
    HandrailGamepadConfig,
    HandrailSim,
    HandrailSimConfig,
)
from handrail.collect.lerobot.mode_action import HOLD, NEXT

pytestmark = pytest.mark.slow
FORWARD = (0.0, 0.0, 0.0, 1.0, *(0.0,) * 14)  # base twist, then the hand's
PATIENCE = 120.0  # [s]


@pytest.fixture
def robot(tmp_path):
    made = HandrailSim(HandrailSimConfig(calibration_dir=tmp_path))
    yield made
    if made.is_connected:
        made.disconnect()


def until(robot, teleop, told_so, each=lambda: None):
    """Run LeRobot's loop until an action is as wanted; return it."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        each()
        robot.get_observation()
        action = teleop.get_action()
        robot.send_action(action)
        if told_so(action):
            return action
    raise TimeoutError


def test_a_person_at_a_page_drives_and_takes_the_next_scene(robot, tmp_path):
    teleop = HandrailCockpit(HandrailCockpitConfig(port=0, open=False, calibration_dir=tmp_path))
    teleop.connect()
    robot.connect()
    try:
        with page(teleop) as socket:
            numbers, stamp = count(1), [0.0]

            def say(axes):
                stamp[0] = told(socket, "frame")["frame"]["stamp"]
                socket.send(drive(next(numbers), stamp[0], axes))

            def ask(what):
                socket.send(json.dumps({"kind": "ask", "what": what, "value": True}))

            assert teleop.get_action()[HOLD]
            until(robot, teleop, lambda action: robot.frame is None)
            ask("mode")  # of no use here
            ask("start")
            until(robot, teleop, lambda action: HOLD not in action, lambda: say((0.0,) * 18))
            until(robot, teleop, lambda action: action["ee.x.vel"] > 0.1, lambda: say(FORWARD))
            until(robot, teleop, lambda action: HOLD in action)  # nothing more comes from the page
            ask("success")
            until(robot, teleop, lambda action: NEXT in action)
            assert robot.get_observation()["scene"] == 1
    finally:
        teleop.disconnect()


@pytest.mark.parametrize(
    ("settings", "channel", "least"),
    [({}, "ee.x.vel", 0.1), ({"robot": "bi_so101", "task": "reach", "hand": "right"}, "right.x.vel", 0.02)],
)
def test_a_person_with_a_gamepad_drives(settings, channel, least, pad, tmp_path):
    """The hand of the action, whichever is chosen."""
    robot = HandrailSim(HandrailSimConfig(calibration_dir=tmp_path, **settings))
    teleop = HandrailGamepad(HandrailGamepadConfig(calibration_dir=tmp_path))
    teleop.connect()
    robot.connect()
    try:
        assert until(robot, teleop, lambda action: HOLD in action)
        for control in (*["a"] * bool(settings), "left_shoulder", "start"):  # `a` is the other hand
            pad.move(control, 1)
        until(robot, teleop, lambda action: HOLD not in action)
        pad.move("left_y", -1.0)
        until(robot, teleop, lambda action: abs(action[channel]) > least)
        pad.move("left_shoulder", 0)
        until(robot, teleop, lambda action: HOLD in action)
        pad.move("y", 1)
        until(robot, teleop, lambda action: NEXT in action)
    finally:
        teleop.disconnect()
        robot.disconnect()


def test_lerobot_s_keys_are_lerobot_s_alone(robot, monkeypatch, tmp_path):
    """Two readers of one terminal get each key by chance."""
    monkeypatch.setattr(open_devices, "has_terminal", lambda: True)
    monkeypatch.setattr(
        open_devices, "_person", lambda *given: SimpleNamespace(person=None, beside=given[-1])
    )
    assert HandrailGamepad(HandrailGamepadConfig(calibration_dir=tmp_path))._made(robot).beside is None


@pytest.mark.parametrize(("task", "more"), [("reach", ["tool"]), ("tray", [])])
def test_nobody_chooses_a_frame_that_an_action_cannot_say(task, more, pad, tmp_path, capsys):
    """In `tray` the mode `ee` has some of the hand's axes: no action says these in the tool's."""
    robot = HandrailSim(HandrailSimConfig(task=task, calibration_dir=tmp_path))
    made = HandrailGamepad(HandrailGamepadConfig(calibration_dir=tmp_path))._made(robot)
    chosen = set()
    for _ in range(4):
        made.person.ask(choice_of("frame", made.person))
        chosen.add(made.person.setting.frame)
    made.close()
    assert chosen == {"base", "world", *more}
    assert ("not steered in the tool's frame" in capsys.readouterr().out) is (not more)

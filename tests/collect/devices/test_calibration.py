"""Laws of calibrations: what is guided is what was turned; a file keeps it; a wrong one is one line."""

import json
import math
import re

import numpy as np
import pytest
from played_leader import CALIBRATION, PLAYED, UR10, PlayedLeaderConfig

from handrail.collect.devices.calibration import (
    LeaderGripper,
    calibration_file,
    how_to_calibrate,
    load_calibration,
    same_arm,
    save_calibration,
)
from handrail.collect.devices.follower import Follower
from handrail.collect.devices.guided_calibration import calibrate
from handrail.collect.devices.leader_arm import make_teleoperator
from handrail.collect.teleop_config import CalibrateConfig, LeaderConfig
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import load_model

TYPE = PlayedLeaderConfig.get_choice_name(PlayedLeaderConfig)
REST = {"pan.pos": 10.0, "lift.pos": -20.0, "flex.pos": 5.0, "handle.pos": 80.0}


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    """LeRobot's calibrations lie where it was imported from: here, below the test's own folder."""
    monkeypatch.setattr("lerobot.utils.constants.HF_LEROBOT_CALIBRATION", tmp_path)
    monkeypatch.setattr("lerobot.teleoperators.teleoperator.HF_LEROBOT_CALIBRATION", tmp_path)
    PLAYED.actions, PLAYED.last, PLAYED.plugged, PLAYED.calibrated = [], dict(REST), True, False


class Hands:
    """A person who does what they are asked: turns a joint, types, presses Enter."""

    def __init__(self, *does):
        self.does, self.asked = list(does), []

    def __call__(self, words):
        self.asked.append(words)
        typed, turned = self.does.pop(0) if self.does else ("", {})
        PLAYED.last = {name: value + turned.get(name, 0.0) for name, value in PLAYED.last.items()}
        return typed


def run(hands, unit="degrees"):
    config = CalibrateConfig(LeaderConfig(type=TYPE, id="mine", options="calibrated=false"), unit=unit)
    assert calibrate(config, hands) == 0
    path = calibration_file(config.teleop, "ridgeback_ur10")
    return load_calibration(path, UR10, "advice")


GUIDED = (
    ("", {"pan.pos": 80.0, "lift.pos": 3.0}),
    ("", {"lift.pos": -95.0}),
    ("-", {}),
    ("", {"flex.pos": 40.0}),
    ("-", {}),
    ("-", {}),
    ("", {"handle.pos": 10.0}),
    ("", {"handle.pos": -70.0}),
)


def test_turned_joints_drive_the_requested_ones_the_right_way(capsys):
    found = run(Hands(*GUIDED))
    assert {name: (joint.source, round(joint.scale, 6)) for name, joint in found.joints.items()} == {
        UR10[0]: ("pan.pos", round(math.pi / 180, 6)),
        UR10[1]: ("lift.pos", -round(math.pi / 180, 6)),
        UR10[3]: ("flex.pos", round(math.pi / 180, 6)),
    }
    assert found.gripper == LeaderGripper("handle.pos", closed=20.0, opened=90.0)
    home = np.array(load_model().description.home)[3:]
    stands = found.angles(PLAYED.last, UR10)  # at last
    assert stands[[0, 1, 3]] == pytest.approx(home[[0, 1, 3]])
    assert PLAYED.calibrated  # by LeRobot first, which had not done so
    assert "saved: " in capsys.readouterr().out


def test_another_unit_is_measured_by_the_quarter_turn():
    scale = run(Hands(*GUIDED), "other").joints[UR10[1]].scale
    assert scale == pytest.approx(-0.5 * math.pi / 95.0)


def test_a_leader_in_radians_has_a_handle_too():
    hands = Hands(*((typed, {name: math.radians(each) for name, each in by.items()}) for typed, by in GUIDED))
    found = run(hands, "radians")
    assert found.gripper is not None
    assert found.gripper.closed - found.gripper.opened == pytest.approx(math.radians(-70.0))
    assert found.joints[UR10[0]].scale == 1.0


@pytest.mark.parametrize("unit", ["degrees", "other"])
@pytest.mark.parametrize("turned", [{}, {"pan.pos": 9.0}, {"pan.pos": 80.0, "flex.pos": 60.0}])
def test_an_unclear_answer_is_asked_again(turned, unit, capsys):
    hands = Hands(("", turned), *GUIDED)
    assert run(hands, unit).joints[UR10[0]].source == "pan.pos"
    assert sum(words.startswith(UR10[0]) for words in hands.asked) == 2
    assert "Once more" in capsys.readouterr().out


def test_a_joint_drives_one_joint_alone():
    again = ("", {"pan.pos": -90.0})
    hands = Hands(GUIDED[0], again, *GUIDED[1:])
    assert run(hands).joints[UR10[1]].source == "lift.pos"


@pytest.mark.parametrize("garbage", [{}, {"pan.pos": math.nan}, None, ConnectionError("gone")])
def test_a_leader_that_says_nothing_is_one_line(garbage):
    PLAYED.last = garbage
    with pytest.raises(HandrailError, match="leader arm: "):
        run(Hands())


def test_nothing_at_all_is_no_calibration():
    with pytest.raises(HandrailError, match="at least one joint"):
        run(Hands(*[("-", {})] * 6))


def test_a_file_keeps_it(tmp_path):
    path = tmp_path / "new" / "leader.json"
    save_calibration(CALIBRATION, path)
    assert load_calibration(path, UR10, "advice") == CALIBRATION


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"joints": {"tail": {"source": "a.pos", "scale": 1.0}}}, "unknown entry 'tail'; expected some of"),
        ({"joints": {UR10[0]: {"source": "a.pos", "scale": 0.0}}}, "scale: expected a finite number, not 0"),
        ({"joints": {UR10[0]: {"source": "a.pos", "scale": math.nan}}}, "malformed"),
        ({"joints": {UR10[0]: 3}}, "expected a table"),
        ({"joints": []}, "expected a table"),
        ({"gripper": {"source": "g.pos", "closed": 1.0, "opened": 1.0}}, "closed and opened to differ"),
        ({"wrong": 1}, "unknown entry 'wrong'"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(tmp_path, change, said):
    path = tmp_path / "leader.json"
    path.write_text(json.dumps({"joints": {}, **change}))
    with pytest.raises(HandrailError, match=re.escape(said)):
        load_calibration(path, UR10, "handrail-devices calibrate")


def test_no_file_or_no_json_says_how_to_make_one(tmp_path):
    advice = how_to_calibrate(LeaderConfig(type="so101_leader", port="/dev/ttyACM0"), "ridgeback_ur10")
    flags = "--teleop.type=so101_leader --teleop.port=/dev/ttyACM0 --robot=ridgeback_ur10"
    assert advice == f"handrail-devices calibrate {flags}"
    (tmp_path / "torn.json").write_text("{")
    for name in ("none.json", "torn.json"):
        with pytest.raises(HandrailError, match=advice):
            load_calibration(tmp_path / name, UR10, advice)


@pytest.mark.parametrize(
    ("config", "said"),
    [
        (LeaderConfig(type="nobody"), "unknown --teleop.type 'nobody': expected one of"),
        (LeaderConfig(type=TYPE, options="speed=3"), "speed"),
        (LeaderConfig(type=TYPE, options="calibrated"), "expected name=value"),
        (LeaderConfig(type=TYPE, options="calibrated=perhaps"), "bool"),
        (LeaderConfig(type="so101_leader"), "port"),
    ],
)
def test_lerobots_own_settings_are_checked_by_lerobot_and_said_in_one_line(config, said):
    with pytest.raises(HandrailError, match=said) as error:
        make_teleoperator(config)
    assert config.type in str(error.value)


def test_the_arm_goes_as_many_degrees_as_its_leader():
    model = load_model("lekiwi")
    arm = model.description.arm_joints
    calibration = same_arm(LeaderConfig("so101_leader"), arm)
    follower, q = Follower(model, calibration), model.description.home
    leader = {f"{name}.pos": 10.0 * index for index, name in enumerate(arm)} | {"gripper.pos": 10.0}
    follower.targets(leader, True, q)
    turned = {name: value + 5.0 for name, value in leader.items()}
    assert np.array(follower.targets(turned, True, q)) - q[3:] == pytest.approx(np.radians([5.0] * 5))
    assert follower.grips(leader, False)
    assert not follower.grips({**leader, "gripper.pos": 90.0}, True)


@pytest.mark.parametrize(
    ("leader", "options", "robot"),
    [
        ("koch_leader", "", "lekiwi"),
        ("so101_leader", "use_degrees=false", "lekiwi"),
        ("so101_leader", "", "ridgeback_ur10"),
    ],
)
def test_any_other_pair_is_calibrated(leader, options, robot):
    assert same_arm(LeaderConfig(leader, options=options), load_model(robot).description.arm_joints) is None

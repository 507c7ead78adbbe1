"""Laws of a leader arm: recorded motion comes through; garbage, jumps and a cut cable steer nothing."""

import math
import os
import pty

import pytest
from device_players import recorded
from played_leader import CALIBRATION, PLAYED, SOURCES, UR10, PlayedLeader, PlayedLeaderConfig

from handrail.collect.devices import leader_arm
from handrail.collect.devices.leader_arm import LeaderArm
from handrail.controllers.errors import HandrailError

FIRST = recorded("leader.json")[0]["action"]


@pytest.fixture(autouse=True)
def played():
    PLAYED.actions, PLAYED.last, PLAYED.plugged, PLAYED.calibrated = [], dict(FIRST), True, False


def leader(tmp_path, clock, **settings):
    config = PlayedLeaderConfig(id="mine", calibration_dir=tmp_path, **settings)
    return LeaderArm(lambda: PlayedLeader(config), "played_leader", SOURCES, clock)


@pytest.fixture
def arm(tmp_path, clock):
    made = leader(tmp_path, clock)
    made.open()
    return made


def test_recorded_motion_comes_through_in_the_arms_terms(arm, clock):
    start, before = clock.now, False
    grips = []
    for event in recorded("leader.json"):
        clock.now = start + event["time"]
        PLAYED.actions = [event["action"]]
        reading = arm.read()
        assert reading.time == clock.now
        assert set(reading.joints) == set(SOURCES)
        before = CALIBRATION.gripper.grips(reading.joints, before)
        grips.append(before)
    angles = CALIBRATION.angles(reading.joints, UR10)
    assert angles[0] == pytest.approx(1.0 + math.radians(event["action"]["shoulder_pan.pos"]))
    assert angles[2] == pytest.approx(-math.radians(event["action"]["elbow_flex.pos"]))
    assert not angles[[1, 3, 4, 5]].any()  # which no joint of the leader drives
    assert grips == sorted(grips)  # closed once, without a flutter
    assert grips[-1]


@pytest.mark.parametrize(
    "garbage",
    [
        FIRST | {"shoulder_pan.pos": math.nan},
        FIRST | {"elbow_flex.pos": -math.inf},
        FIRST | {"elbow_flex.pos": "left"},
        FIRST | {"elbow_flex.pos": None},
        FIRST | {"shoulder_pan.pos": FIRST["shoulder_pan.pos"] + 60.0},
        {name: value for name, value in FIRST.items() if name != "gripper.pos"},
        {},
        None,
        ConnectionError("Incorrect status packet!"),
    ],
    ids=str,
)
def test_garbage_is_as_old_as_what_came_before_it(arm, clock, garbage):
    good = arm.read()
    PLAYED.actions = [garbage]
    clock.now += 0.1
    assert arm.read() == good
    PLAYED.actions = [FIRST]
    clock.now += 0.1
    assert arm.read().time == clock.now


def test_nothing_but_garbage_for_a_second_is_a_device_that_is_gone(arm, clock):
    PLAYED.last = ConnectionError("no status packet")
    clock.now += 0.9
    arm.read()
    clock.now += 0.2
    with pytest.raises(ConnectionError, match="no status packet"):
        arm.read()


def test_a_cut_cable_is_a_device_that_is_gone_at_once(arm):
    PLAYED.plugged = False
    with pytest.raises(ConnectionError, match="not connected"):
        arm.read()
    arm.close()
    with pytest.raises(HandrailError, match="no such port"):
        arm.open()
    PLAYED.plugged = True
    arm.open()
    assert arm.read().joints


@pytest.mark.parametrize("arms", [1, 2])
def test_the_ports_of_arms_that_are_unplugged_are_closed(tmp_path, monkeypatch, arms):
    """By LeRobot's own leaders; one whose port stayed open came back under another name."""
    pytest.importorskip("scservo_sdk", reason="pip install 'lerobot[feetech]'")
    from lerobot.teleoperators.bi_so_leader import BiSOLeader, BiSOLeaderConfig
    from lerobot.teleoperators.so_leader import SO101Leader, SO101LeaderConfig, SOLeaderConfig

    pairs = [pty.openpty() for _ in range(arms)]
    ports = [os.ttyname(slave) for _, slave in pairs]
    if arms == 1:
        made = SO101Leader(SO101LeaderConfig(port=ports[0], calibration_dir=tmp_path))
        buses = [made.bus]
    else:
        left, right = map(SOLeaderConfig, ports)
        sides = {"left_arm_config": left, "right_arm_config": right}
        made = BiSOLeader(BiSOLeaderConfig(calibration_dir=tmp_path, **sides))
        buses = [made.left_arm.bus, made.right_arm.bus]

    def connected(teleoperator, name):
        for bus in buses:
            bus.connect(handshake=False)
        return teleoperator

    monkeypatch.setattr(leader_arm, "connected", connected)
    arm = LeaderArm(lambda: made, "leader", SOURCES)
    arm.open()
    for end in (end for pair in pairs for end in pair):
        os.close(end)
    with pytest.raises(Exception):  # noqa: B017, PT011  whatever a driver's code raises
        arm.close()
    assert not any(bus.port_handler.is_open for bus in buses)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"calibrated": False}, "not calibrated; run lerobot-calibrate"),
        ({"refuses": "[Errno 13] Permission denied: '/dev/ttyACM0'"}, "usermod -aG dialout"),
        ({"refuses": "could not open port"}, "check --teleop.port"),
    ],
)
def test_one_that_cannot_be_used_says_what_to_do(tmp_path, clock, settings, said):
    with pytest.raises(HandrailError, match=said):
        leader(tmp_path, clock, **settings).open()

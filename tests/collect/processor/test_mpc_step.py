"""The masked MPC as a step of LeRobot's processors."""

import json
import math
import sys

import numpy as np
import pytest
from processor_helpers import PERIOD, Clock, Drive

from handrail.collect.processor.mpc_step import NAME, MaskedMpcStep, load_pipeline
from handrail.collect.processor.units import robot_units
from handrail.collect.processor.whole_body import moved
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import load_model

AHEAD = {"ee.vx": 0.2, "ee.vy": 0.0, "ee.vz": 0.0, "ee.wx": 0.0, "ee.wy": 0.0, "ee.wz": 0.0}


def degrees(**more) -> dict:
    """Return units in which every joint is said otherwise than in the description."""
    arm = load_model().description.arm_joints
    joints = {name: {"name": f"arm_{i}", "sign": (-1) ** i, "zero": 10.0 * i} for i, name in enumerate(arm)}
    joints[arm[-1]] |= {"unit": "range", "zero": 0.0}
    return {"joints": joints, "base": {}, "gripper": {"name": "g.pos", "opened": 100.0, "closed": 0.0}} | more


@pytest.mark.parametrize("units", ["plain", degrees()], ids=["radians", "degrees"])
def test_the_hand_goes_as_asked_and_the_whole_robot_keeps_its_limits(units):
    drive = Drive(units=units)
    start = drive.hand
    drive.go(AHEAD, 2.0)
    assert drive.hand - start == pytest.approx([0.4, 0.0, 0.0], abs=0.03)
    assert np.linalg.norm(drive.robot.pose[:2]) > 0.1  # the base comes along, and its odometry is right
    assert not drive.step.counts
    readings = [drive.robot.units.read(action) for action in drive.sent]
    arm = np.array([reading.arm for reading in readings])
    limits, base = drive.model.description.limits, 3
    velocity = np.diff(arm, axis=0) / PERIOD
    assert (np.abs(velocity) <= limits.velocity[base:] + 1e-6).all()
    assert (np.abs(np.diff(velocity, axis=0)) <= PERIOD * limits.acceleration[base:] + 1e-6).all()
    twist = np.array([reading.twist for reading in readings])
    assert (np.abs(np.diff(twist[:, 2])) <= PERIOD * limits.acceleration[2] + 1e-6).all()


def test_an_obstacle_is_kept_from():
    pillar = {"name": "pillar", "kind": "cylinder", "size": [0.15, 0.4], "position": [0.95, 0.1, 0.2]}
    without, beside = Drive(), Drive(obstacles=[pillar])
    closest = math.inf
    for drive in (without, beside):
        for _ in range(90):
            drive.go(AHEAD)
            if drive is beside:
                closest = min(closest, drive.step.diagnostics.smallest_distance)
    assert np.linalg.norm(without.robot.pose - beside.robot.pose) > 0.05
    assert closest > 0.0


def test_loaded_from_its_file_it_says_the_same(tmp_path):
    drive = Drive(
        units=degrees(), inputs={"delta_x": ["ee.vx", 0.2]}, settings={"margin": 0.05}, start=[1, 2, 3]
    )
    drive.pipeline.save_pretrained(tmp_path)
    clock = Clock()
    loaded = load_pipeline(tmp_path, clock)
    for index in range(40):
        action = {"delta_x": 1.0, "ee.vz": 0.1} if index < 25 else {"base.wz": 0.2, "gripper": 1.0}
        action |= {"ee.vx": math.nan} if index == 30 else {}
        clock.now = drive.clock.now
        said = loaded((action, drive.robot.observation()))
        assert said == drive.go(action)
    assert drive.step.counts == {"invalid_intent": 1}


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ({"ee.vx": math.nan}, "invalid_intent"),
        ({"ee.vx": "fast"}, "invalid_intent"),
        ({"ee.vx": None}, "invalid_intent"),
        ({"ee.vx": 0.1, "ee.typo": 0.0}, "invalid_intent"),
        ({"ee.vx": 0.1, "gripper": math.inf}, "invalid_intent"),
        ({"ee.vx": 0.1, "time": 1e9}, "invalid_intent"),
        ({"ee.vx": 0.1, "time": 99.0}, "stale_intent"),
    ],
)
def test_wrong_actions_brake_and_are_counted(wrong, why):
    drive = Drive()
    drive.go(AHEAD, 1.0)
    drive.go(wrong, 2.0)
    assert not drive.moves(drive.go(wrong))
    assert drive.step.counts == {why: 61}
    drive.go(AHEAD, 0.3)
    assert drive.moves(drive.sent[-1])
    assert drive.step.counts == {why: 61}


@pytest.mark.parametrize("wrong", [{}, None, {"base": 1}, "nan"])
def test_observations_that_make_no_sense_brake(wrong):
    drive = Drive()
    drive.go(AHEAD, 1.0)
    for _ in range(60):
        broken = drive.robot.observation() | {"shoulder_pan_joint.pos": math.nan} if wrong == "nan" else wrong
        drive.robot.send(drive.pipeline((AHEAD, broken)))
        drive.clock.now += PERIOD
    assert np.abs(drive.robot.twist).max() < 1e-9
    assert set(drive.step.counts) == {"malformed_observation"}


def test_the_very_same_observation_is_stale_after_its_time():
    drive = Drive()
    drive.go(AHEAD, 1.0)
    old, statuses = drive.robot.observation(), []
    for _ in range(60):
        drive.robot.send(drive.pipeline((AHEAD, old)))
        statuses.append(drive.step.diagnostics.status.brakes)
        drive.clock.now += PERIOD
    assert statuses.index(True) == 8  # a quarter of a second
    assert all(statuses[8:])
    assert np.abs(drive.robot.twist).max() < 1e-9
    assert set(drive.step.counts) == {"stale_observation"}


def test_a_clock_that_stands_brakes():
    drive = Drive()
    drive.go(AHEAD, 1.0)
    for _ in range(60):
        drive.robot.send(drive.pipeline((AHEAD, drive.robot.observation())))
    assert not drive.moves(drive.pipeline((AHEAD, drive.robot.observation())))
    assert set(drive.step.counts) == {"invalid_state"}


def test_a_joint_that_is_blocked_is_not_sent_far_ahead():
    drive = Drive()
    arm = drive.robot.arm.copy()
    for _ in range(120):
        sent = drive.pipeline(({"joint.elbow_joint": 1.0}, drive.robot.observation()))
        drive.robot.send(sent)
        drive.robot.arm = arm
        drive.clock.now += PERIOD
        assert np.abs(drive.robot.units.read(sent).arm - arm).max() <= 0.3 + 1e-9


def test_a_leaders_joints_and_the_base_s_keys_are_followed():
    drive = Drive(units=degrees())
    names = drive.robot.units.positions
    leader = {name: value + 5.0 for name, value in drive.robot.observation().items() if name in names}
    drive.go({**leader, "x.vel": 0.1, "y.vel": 0.0, "theta.vel": 0.0, "g.pos": 0.0}, 4.0)
    now = drive.robot.observation()
    assert [now[name] for name in names] == pytest.approx([leader[name] for name in names], abs=0.5)
    assert now["x.vel"] == pytest.approx(0.1, abs=0.01)
    assert drive.sent[-1]["g.pos"] == 0.0


@pytest.mark.parametrize("unit", ["radians", "degrees"])
def test_a_leader_is_followed_by_a_joint_that_takes_a_velocity_and_does_less(unit):
    units, one = degrees(), {"radians": 1.0, "degrees": 180.0 / math.pi}[unit]
    units["joints"] |= {"elbow_joint": {"name": "elbow", "unit": unit, "sends": "velocity", "sign": -1}}
    drive, angle = Drive(units=units), -one
    for _ in range(150):
        seen = drive.robot.observation() | {"elbow.pos": angle}
        angle += 0.7 * PERIOD * drive.pipeline(({"elbow.pos": -1.5 * one}, seen))["elbow.vel"]
        drive.clock.now += PERIOD
    assert angle == pytest.approx(-1.5 * one, rel=0.01)
    for _ in range(30):
        seen = drive.robot.observation() | {"elbow.pos": angle}
        sent = drive.pipeline(({"elbow.vel": 0.2 * one}, seen))["elbow.vel"]
        angle += PERIOD * sent
        drive.clock.now += PERIOD
    assert sent == pytest.approx(0.2 * one, rel=0.02)
    assert not drive.step.counts


@pytest.mark.parametrize("level", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("action", [{}, {"gripper": 1.0}], ids=["unnamed", "stay"])
def test_a_gripper_that_nobody_moves_stays_as_it_was(action, level):
    drive = Drive(gripper="actions")
    drive.robot.grips[:] = level
    drive.go(AHEAD | action, 0.5)
    assert [sent["gripper.pos"] for sent in drive.sent] == pytest.approx([level] * len(drive.sent))
    assert not drive.step.counts


@pytest.mark.parametrize(
    "wrong", [{"ee.vx": math.nan}, {"ee.typo": 0.0}, {"gripper": math.nan}, {"time": 0.0}]
)
def test_a_gripper_stays_as_it_was_where_the_first_thing_said_brakes(wrong):
    drive = Drive()
    for level in (0.6, 1.0):
        drive.robot.grips[:] = level
        drive.pipeline.reset()
        assert drive.go(AHEAD | wrong, 0.5)["gripper.pos"] == pytest.approx(level)
        assert drive.go(AHEAD, 0.5)["gripper.pos"] == pytest.approx(level)
    assert sum(drive.step.counts.values()) == 30


def test_a_gripper_moves_where_the_robot_begins_too_near_to_something_to_move():
    below = (Drive().hand - [0.0, 0.0, 0.05]).tolist()
    drive = Drive(obstacles=[{"name": "wall", "kind": "box", "size": [0.2, 0.2, 0.2], "position": below}])
    drive.go(AHEAD | {"gripper": 1.0}, 6 * PERIOD)
    assert drive.step.counts == {"backup": 6}
    assert drive.sent[-1]["gripper.pos"] == pytest.approx(6 * drive.sent[0]["gripper.pos"])
    assert drive.sent[0]["gripper.pos"] > 0.0


@pytest.mark.parametrize("name", ["x.vel", "time", "gripper", "gripper.pos", "elbow_joint.pos", "ee.vy"])
def test_an_input_means_what_is_said_of_it_whatever_else_has_its_name(name):
    drive, plain = (Drive(inputs={each: ["ee.vx", 0.2]}) for each in (name, "delta_x"))
    assert drive.go({name: 1.0}, 0.5) == plain.go({"delta_x": 1.0}, 0.5)
    assert not drive.step.counts


def test_odometry_follows_a_circle():
    pose = np.zeros(3)
    for _ in range(600):
        pose = moved(pose, np.array([0.3, 0.1, 1.0]), PERIOD)
    radius, angle = np.array([0.3, 0.1]) / 1.0, 600 * PERIOD
    c, s = math.cos(angle), math.sin(angle)
    exact = [radius[0] * s - radius[1] * (1 - c), radius[0] * (1 - c) + radius[1] * s, angle]
    assert pose == pytest.approx(exact, abs=1e-4)


def test_velocities_are_sent_where_the_robot_takes_them():
    units = degrees()
    for joint in units["joints"].values():
        joint["sends"] = "velocity"
    drive = Drive(units=units)
    drive.robot.units = robot_units(degrees(), drive.model.description)  # which says positions
    sent = drive.pipeline(({"joint.elbow_joint": 0.5}, drive.robot.observation()))
    rate = np.array([sent[f"arm_{i}.vel"] for i in range(6)])
    limit = drive.model.description.limits.acceleration[3 + 2] * PERIOD
    assert 0.0 < math.radians(rate[2]) <= limit + 1e-9


def test_it_says_the_robot_s_own_action():
    from lerobot.datasets import aggregate_pipeline_dataset_features, create_initial_features

    drive = Drive()
    features = aggregate_pipeline_dataset_features(
        pipeline=drive.pipeline, initial_features=create_initial_features(action={"ee.vx": float})
    )
    assert features["action"]["names"] == list(drive.robot.units.action_names)


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ({"robot": "nobody"}, "unknown robot"),
        ({"units": "yards"}, "unknown units 'yards': expected one of bi_openarm_follower, bi_so"),
        ({"units": {"joints": {}}}, "expected joints shoulder_pan_joint"),
        ({"units": {"joints": {"a": {"name": "a", "unit": "yards"}}}}, "unit: expected one of degrees"),
        ({"inputs": {"a": ["ee.up", 1.0]}}, "'ee.up': expected one of"),
        ({"inputs": {"a": "ee.vx"}}, "inputs: expected a list"),
        ({"settings": {"horizons": 3}}, "expected some of horizon, .*nearest: horizon"),
        ({"obstacles": [{"name": "a"}]}, "expected an entry 'kind'"),
        ({"fps": 0}, "fps"),
        ({"fps": 9}, "at least 10 Hz"),
        ({"start": [0, 0]}, "start"),
        ({"start": [0, math.inf, 0]}, "start"),
        ({"robot": "lekiwi", "start": [0, 5, 0]}, r"start of joint y: expected -2\.0 to 2\.0, got 5$"),
        ({"timeout": math.nan}, "timeout"),
        ({"settings": 3}, "settings: expected a table"),
        ({"units": {"joints": {}, "gripper": {"name": "g", "opened": 1, "closed": 1}}}, "to differ"),
        ({"tool_frame": "moon"}, "tool_frame"),
        ({"robot": []}, "robot: expected a text"),
        ({"units": degrees(gripper={"name": "arm_0.pos", "opened": 1, "closed": 0})}, "each name once"),
        ({"units": degrees(base={"x": "x.vel", "y": "x.vel"})}, "each name once"),
        ({"units": degrees(base={"pose": ["x.pos", "y.pos", "arm_0.pos"]})}, "each name once"),
    ],
)
def test_wrong_settings_are_named(setting, words):
    with pytest.raises(HandrailError, match=words):
        MaskedMpcStep(**setting)


def test_names_that_the_robot_does_not_say_are_told_at_once():
    with pytest.raises(HandrailError, match=r"expected finite numbers shoulder_pan_joint\.pos"):
        Drive().pipeline((AHEAD, {"other.pos": 1.0}))


def test_a_stranger_s_processor_imports_nothing(tmp_path):
    Drive().pipeline.save_pretrained(tmp_path)
    file = tmp_path / f"{NAME}.json"
    good = json.loads(file.read_text())
    for steps in (
        [{"class": "os.system", "config": {}}],
        [*good["steps"], {"class": "os.system", "config": {}}],
        [{**good["steps"][0], "config": {"robot": "antigravity:X"}}],
    ):
        file.write_text(json.dumps({**good, "steps": steps}))
        with pytest.raises(HandrailError, match=r"expected the step|may not choose what is imported"):
            load_pipeline(tmp_path, Clock())
    assert "antigravity" not in sys.modules

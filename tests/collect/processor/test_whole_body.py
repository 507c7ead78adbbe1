"""A robot of LeRobot's as a whole body: where it is expected, whatever its odometry says."""

import inspect
import math
import time
from dataclasses import replace

import numpy as np
import pytest
from places import ROOT
from processor_helpers import PERIOD, Drive

from handrail.collect.lekiwi.link import Link
from handrail.collect.processor.mpc_step import MaskedMpcStep
from handrail.collect.processor.units import robot_units
from handrail.collect.processor.whole_body import WholeBody
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import RobotModel, load_model
from handrail.controllers.robot.parts import Limits

MODEL = load_model("lekiwi")
DESCRIPTION = MODEL.description
TURN = np.append(np.where(np.arange(MODEL.size) == 2, 0.4, 0.0), 0.0)
UNITS = {
    "joints": {name: {"name": name, "unit": "radians"} for name in DESCRIPTION.arm_joints},
    "base": {"unit": "radians", "pose": ["px", "py", "ph"]},
    "gripper": {"name": "g", "opened": 0.0, "closed": 1.0},
}
ARM = dict(zip((f"{name}.pos" for name in DESCRIPTION.arm_joints), DESCRIPTION.home[3:], strict=True))


def driven(start, corrected=0.0):
    """Turn a base with odometry, which is corrected once; return how far off it is expected, (T, 3)."""
    body, pose, off = WholeBody(MODEL, robot_units(UNITS, DESCRIPTION), 0.05), np.array([0.0, 0.0, start]), []
    for step in range(60):
        pose[0] += corrected if step == 20 else 0.0
        said = {"g": 0.0, "px": pose[0], "py": pose[1], "ph": math.remainder(pose[2], 2.0 * math.pi)}
        state = body.observe(ARM | said, 0.05 * (step + 1))
        away = state.expected[:3] - pose
        off.append([*away[:2], math.remainder(away[2], 2.0 * math.pi)])
        body.send(TURN)
        pose[2] += 0.05 * body.velocity[2]
    return np.array(off)


@pytest.mark.parametrize(("start", "corrected"), [(2.9, 0.0), (-0.5, 1.0), (2.9, -1.0)])
def test_a_base_is_expected_where_it_is_though_its_heading_wraps_or_its_place_is_corrected(start, corrected):
    """Law: ±π is one heading, and a correction of odometry is no motion."""
    usual = driven(-0.5)
    np.testing.assert_allclose(driven(start, corrected), usual, atol=1e-6)
    assert np.abs(usual).max() < 0.1


def test_a_base_turns_on_however_often_it_has_turned():
    drive = Drive(robot="lekiwi", units="lekiwi", start=[0.0, 0.0, 6.2])
    drive.go({"base.wz": 0.3}, 2.0)
    assert drive.robot.pose[2] > 0.45


def test_a_heading_after_some_turns_is_that_within_half_a_turn():
    """The MPC's range of headings is ±2π: beyond it the robot would turn back by itself."""
    body = WholeBody(MODEL, robot_units(UNITS, DESCRIPTION), 0.05)
    state = body.observe(ARM | {"g": 0.0, "px": 0.1, "py": 0.2, "ph": 13.0}, 0.05)
    np.testing.assert_allclose(state.q[:3], [0.1, 0.2, 13.0 - 4.0 * math.pi], atol=1e-9)
    body.place([0.0, 0.0, -7.0])
    assert body.observe(ARM | {"g": 0.0, "px": 0.0, "py": 0.0, "ph": -7.0}, 0.1).q[2] > -1.0


def test_a_fixed_robot_of_two_joints_is_a_body_too():
    arm = load_model(ROOT / "docs/examples/so101.toml").description
    limits = Limits(**{name: values[:2] for name, values in vars(arm.limits).items()})
    short = replace(arm.arms[0], joints=arm.arms[0].joints[:2])
    model = RobotModel(replace(arm, arms=(short,), home=arm.home[:2], limits=limits))
    units = robot_units("plain", model.description)
    body = WholeBody(model, units, 0.05)
    np.testing.assert_array_equal(body.observe(dict.fromkeys(units.observation_names, 0.0), 0.05).q, 0.0)
    assert body.send([0.1, 0.0, 0.0])


@pytest.mark.parametrize("rate", [20.0, 15.0])
def test_in_a_slow_loop_the_arm_keeps_pace_with_the_base(rate):
    drive = Drive(robot="lekiwi", units="lekiwi")
    start = drive.hand  # is asked to stand
    drive.go({"base.vx": -0.03, "ee.vx": 0.0, "ee.vy": 0.0, "ee.vz": 0.0}, 3.0, 1.0 / rate)
    assert drive.robot.pose[0] < -0.07
    assert np.linalg.norm(drive.hand - start) < 0.005
    assert not drive.step.counts


def test_in_a_slow_loop_no_joint_is_sent_past_its_range():
    drive, joint = Drive(robot="lekiwi", units="lekiwi"), DESCRIPTION.arm_joints[0]
    drive.go({f"joint.{joint}": 1.5}, 4.0, 1.0 / 15.0)
    past = drive.robot.arm[0] - DESCRIPTION.limits.position_upper[3]
    assert -0.05 < past < 0.002


@pytest.mark.parametrize("start", [[0.0, 0.0, 0.0], [1.0, 0.0, 2.0]])
def test_after_a_reset_in_motion_the_base_goes_on_within_its_limits(start):
    drive = Drive(start=start)
    limits, twist = drive.model.description.limits, {"base.vx": 0.4, "base.vy": 0.1, "base.wz": 0.3}
    drive.robot.pose = np.array(start)
    drive.go(twist, 2.0)
    drive.robot.pose = np.array(start)
    drive.pipeline.reset()
    for wanted in (twist, {"base.vx": 0.0, "base.vy": 0.0, "base.wz": 0.0}):
        for _ in range(5):
            before = drive.robot.twist
            drive.go(wanted)
            change = np.abs(drive.robot.twist - before)
            assert (change <= PERIOD * limits.acceleration[:3] + 0.02).all()  # the frame turns, too
            if wanted is twist:
                np.testing.assert_allclose(drive.robot.twist, [0.4, 0.1, 0.3], atol=0.05)


def test_a_base_that_is_too_fast_at_a_reset_counts_as_its_limit():
    drive = Drive()
    fastest = drive.model.description.limits.velocity[0]
    drive.robot.twist = np.array([2.0 * fastest, 0.0, 0.0])
    drive.go({"base.vx": fastest, "base.vy": 0.0, "base.wz": 0.0})
    assert 0.8 * fastest < drive.robot.twist[0] <= fastest + 1e-9


@pytest.mark.parametrize("on", [0.0, 1.0])
def test_after_a_halt_a_base_goes_on_from_what_it_measures(on):
    """Law: a watchdog has stopped it, or none has; either way what is sent keeps the limits."""
    drive, still = Drive(robot="lekiwi", units="lekiwi"), {"base.vx": 0.0, "base.vy": 0.0, "base.wz": 0.0}
    drive.go(still | {"base.vx": 0.2}, 2.0)
    drive.clock.now += 3.0
    drive.robot.twist = before = on * drive.robot.twist
    assert abs(drive.go(still)["x.vel"] - before[0]) <= PERIOD * DESCRIPTION.limits.acceleration[0] + 1e-9


def test_a_stop_after_a_halt_moves_no_base_that_its_watchdog_has_stopped():
    units = robot_units("lekiwi", DESCRIPTION)
    body = WholeBody(MODEL, units, PERIOD)
    rest = units.action(DESCRIPTION.home[3:], np.zeros(5), np.zeros(3), (0.0,))
    for period in range(40):
        body.observe(dict(rest), period * PERIOD)
        said = body.send(np.append(np.where(np.arange(MODEL.size) < 1, 0.2, 0.0), 0.0))
    assert said["x.vel"] > 0.1
    body.pass_time(40 * PERIOD + 3.0)
    assert body.send(())["x.vel"] == 0.0


def test_clocks_of_a_robot_count_the_sleep_of_the_computer(monkeypatch):
    """Law: a sleep is a halt, in which the robot's watchdog stops the base."""
    monkeypatch.setattr(time, "clock_gettime", lambda clock: 3600.0)
    clocks = [inspect.signature(made).parameters["clock"].default for made in (MaskedMpcStep, Link)]
    assert [clock() for clock in clocks] == [3600.0, 3600.0]


@pytest.mark.parametrize("rate", [20.0, 75.0, 100.0])
def test_a_base_is_where_its_wheels_say_though_it_speaks_less_often_than_it_is_asked(rate):
    """Blocked wheels for 2 s, of a robot that speaks 30 times a second."""
    units, heard, said = robot_units("lekiwi", DESCRIPTION), -1.0, {}
    rest = units.action(DESCRIPTION.home[3:], np.zeros(5), np.zeros(3), (0.0,))
    body = WholeBody(MODEL, units, 1.0 / rate)
    ahead = np.append(np.where(np.arange(MODEL.size) == 0, 0.1, 0.0), 0.0)
    for step in range(round(2.0 * rate)):
        if step / rate - heard > 1 / 31:
            heard, said = step / rate, dict(rest)
        state = body.observe(said, step / rate)
        body.send(ahead)
    assert abs(state.q[0]) < 0.02


@pytest.mark.parametrize("scale", [math.degrees(1.0), -1.0])
def test_a_robot_in_other_units_is_refused_before_it_moves(scale):
    """The first observation has to make sense; a joint a little beyond its range does."""
    arm = load_model(ROOT / "docs/examples/so101.toml")
    units = robot_units("plain", arm.description)
    upper = arm.description.limits.position_upper
    beyond = units.action(upper + 0.4, np.zeros(5), np.zeros(3), (0.0,))
    assert WholeBody(arm, units, 0.05).observe(beyond, 0.0).q[0] == pytest.approx(upper[0] + 0.4)
    said = units.action(scale * upper + np.sign(scale), np.zeros(5), np.zeros(3), (0.0,))
    with pytest.raises(HandrailError, match="joints within their ranges in their units; got"):
        WholeBody(arm, units, 0.05).observe(said, 0.0)


@pytest.mark.parametrize("refused", [{"d": math.nan}, {"time": -1.0}, {"time": 0.15}, {"typo": 0.1}])
def test_the_gripper_of_an_action_that_is_refused_is_forgotten(refused):
    drive = Drive(inputs={"d": ["ee.vx", 0.05]})
    opened = drive.go({"d": 0.1}, 0.5)["gripper.pos"]
    for _ in range(15):
        stamp = drive.clock.now + refused.get("time", 0.0)
        drive.go({"d": 0.1, "gripper": 1.0} | refused | {"time": stamp})
    assert drive.go({"d": 0.1}, 1.0)["gripper.pos"] == pytest.approx(opened)
    assert drive.go({"d": 0.1, "gripper": 1.0}, 1.0)["gripper.pos"] != pytest.approx(opened, abs=0.1)

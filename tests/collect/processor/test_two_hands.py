"""The processor step with two hands: each is steered by its name; units are those of LeRobot's robots."""

import tomllib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from lerobot.robots import make_robot_from_config
from lerobot.robots.bi_openarm_follower import BiOpenArmFollowerConfig
from lerobot.robots.bi_so_follower import BiSOFollowerConfig
from lerobot.robots.openarm_follower import openarm_follower
from lerobot.robots.openarm_follower.config_openarm_follower import OpenArmFollowerConfigBase
from lerobot.robots.reachy2 import Reachy2RobotConfig, robot_reachy2
from lerobot.robots.so_follower import SOFollowerConfig
from processor_helpers import PERIOD, Drive

from handrail.collect.processor.units import robot_units
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.description import load_description

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
HANDS = ("left", "right")
PANDA = EXAMPLES.parents[1] / "controllers" / "robot" / "robots" / "ridgeback_panda.toml"
AXES = ("vx", "vy", "vz", "wx", "wy", "wz")

ARM = """
[[arm]]
urdf = "{urdf}"
prefix = "{name}_"
translation = [0.0, {y}, 0.04]
joints = {joints}
[[hand]]
name = "{name}"
frame = "{name}_{frame}"
"""


def two(folder: Path, file=EXAMPLES / "so101.toml"):
    """Return two arms of a robot beside each other on a table."""
    one = tomllib.loads(file.read_text())
    arm, frame = one["arm"][0], one["hand"][0]["frame"]
    n = len(arm["joints"])
    limits = "\n".join(f"{name} = {values[-n:] * 2}" for name, values in one["limits"].items())
    own = {"urdf": arm["urdf"], "joints": arm["joints"], "frame": frame}
    (folder / "two.toml").write_text(
        'name = "two"\n[base]\nkind = "fixed"\nmass = 1.0\nheight = 0.04\nsize = [0.1, 0.4]\n'
        + ARM.format(name="left", y=0.15, **own)
        + ARM.format(name="right", y=-0.15, **own)
        + f"[home]\nq = {one['home']['q'][-n:] * 2}\n[limits]\n{limits}\n"
        + f'[[collision]]\nname = "plate"\nframe = "left_{frame}"\nsphere = 0.01\n'
        + "[self_collision]\npairs = []\n"
    )
    return load_description(folder / "two.toml")


def two_pandas(folder: Path):
    """Return two arms of seven joints, as OpenArm's are."""
    return two(folder, PANDA)


def reachy2(_):
    """Return a mobile robot with LeRobot's joints of a Reachy 2; other bodies carry them."""
    joints = robot_reachy2.REACHY2_L_ARM_JOINTS | robot_reachy2.REACHY2_R_ARM_JOINTS
    joints |= robot_reachy2.REACHY2_NECK_JOINTS
    names = tuple(name.removesuffix(".pos") for name in joints if "gripper" not in name)
    tiago = load_description("tiago_pro")
    limits = type(tiago.limits)(**{name: each[:20] for name, each in vars(tiago.limits).items()})
    return replace(tiago, arms=(replace(tiago.arms[0], joints=names),), home=tiago.home[:20], limits=limits)


def ahead(hand, speed):
    return {f"{hand}.{axis}": 0.0 for axis in AXES} | {f"{hand}.vx": speed}


def test_each_hand_goes_and_closes_as_it_is_told_and_a_pair_stays_together():
    drive = Drive(robot="tiago_pro")
    models = [drive.model.with_hand(hand) for hand in HANDS]
    gripper = drive.model.description.hands[0].gripper

    def poses():
        q = np.append(drive.robot.pose, drive.robot.arm)
        return [model.pose(q) for model in models]

    def tools():
        return np.array([pose.position for pose in poses()])

    start = tools()
    sent = drive.go(ahead("left", 0.05) | ahead("right", -0.05) | {"right.gripper": 1.0})
    assert sent["right.gripper.pos"] == pytest.approx(PERIOD * gripper.speed / gripper.stroke)
    sent = drive.go(ahead("left", 0.05) | ahead("right", -0.05), 2.0)
    np.testing.assert_allclose(tools() - start, [[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]], atol=0.01)
    assert (sent["left.gripper.pos"], sent["right.gripper.pos"]) == (0.0, 1.0)
    drive.go(ahead("left", 0.0) | ahead("right", 0.0), 0.5)
    own = [np.array(moves)[3:] for moves in drive.model.description.moves]
    before, there = drive.robot.arm, tools()
    level = {"joint.torso_lift_joint": 0.0}
    sent = drive.go(ahead("left", 0.05) | level | {"left.gripper": 1.0}, 1.0)
    assert tools()[0, 0] - there[0, 0] > 0.03
    np.testing.assert_allclose(drive.robot.arm[own[1] & ~own[0]], before[own[1] & ~own[0]], atol=0.02)
    assert (sent["left.gripper.pos"], sent["right.gripper.pos"]) == (1.0, 1.0)  # it stays closed

    def apart():
        one, other = poses()
        return one.rotation.T @ (other.position - one.position)

    pair = {f"pair.{axis}": 0.0 for axis in AXES}
    drive.go(pair, 0.5)
    kept = apart()
    drive.go(pair | {"pair.vx": 0.05, "base.wz": 0.05}, 2.0)
    assert np.linalg.norm(apart() - kept) < 5e-3
    assert not drive.step.counts
    drive.go(ahead("left", 0.05) | {"gripper": 1.0})  # of which hand?
    assert drive.step.counts == {"invalid_intent": 1}


def arms(config, arm):
    return config(left_arm_config=arm("a"), right_arm_config=arm("b"))


@pytest.mark.parametrize(
    ("units", "description", "config", "opened"),
    [
        ("bi_so_follower", two, arms(BiSOFollowerConfig, SOFollowerConfig), 35.0),
        ("bi_openarm_follower", two_pandas, arms(BiOpenArmFollowerConfig, OpenArmFollowerConfigBase), -65.0),
        ("reachy2", reachy2, Reachy2RobotConfig(with_antennas=False), 130.0),
    ],
)
def test_units_of_lerobot_s_two_armed_robots(tmp_path, monkeypatch, units, description, config, opened):
    """The names are those of LeRobot's own robots; what is said and read again is the same."""
    monkeypatch.setattr(openarm_follower, "DamiaoMotorsBus", SimpleNamespace)  # asks for drivers
    monkeypatch.setattr(robot_reachy2, "require_package", lambda *_, **__: None)
    theirs = make_robot_from_config(config)
    robot = description(tmp_path)
    known = robot_units(units, robot)
    assert set(known.action_names) == set(theirs.action_features)
    assert set(known.observation_names) == set(theirs.observation_features)
    q = robot.home[len(robot.base.joints) :] + 0.1
    said = known.action(q, np.zeros(len(q)), np.array([0.1, 0.0, 0.2]), (0.25, 1.0))
    reading = known.read(said)
    np.testing.assert_allclose(reading.arm, q)
    np.testing.assert_allclose(reading.openings, [0.75, 0.0])
    assert said[known.positions[0]] == pytest.approx(np.degrees(q[0]))
    closed = [said[each.name] for each in known.grippers]
    np.testing.assert_allclose(closed, [0.75 * opened, 0.0])
    assert said.get("mobile_base.vtheta", np.degrees(0.2)) == pytest.approx(np.degrees(0.2))
    assert known.read({name: value for name, value in said.items() if name != known.grippers[1].name}) is None


def test_two_arms_on_a_base_add_its_velocities_and_the_head():
    names = robot_units("bi_so_follower", load_description("bi_so101")).action_names
    assert {"left_elbow_flex.pos", "right_gripper.pos", "head_pan.pos", "x.vel", "theta.vel"} < set(names)


GRIPPER = {"name": "g", "opened": 1, "closed": 0}


@pytest.mark.parametrize(
    ("table", "hands", "words"),
    [
        ({"gripper": GRIPPER}, 2, "expected grippers of left, right"),
        ({"grippers": {"third": GRIPPER}}, 2, "expected grippers of left, right"),
        ({"grippers": {"left": GRIPPER}}, 1, "expected gripper alone"),
    ],
)
def test_grippers_that_are_nobody_s_are_refused(tmp_path, table, hands, words):
    description = two(tmp_path) if hands == 2 else load_description(EXAMPLES / "so101.toml")
    with pytest.raises(HandrailError, match=words):
        robot_units({"joints": {}} | table, description)

"""The processor step with two hands: each is steered by its name; units are those of LeRobot's robots."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from processor_helpers import PERIOD, Drive

from handrail.collect.processor.units import robot_units
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.description import load_description

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
TIAGO, HANDS = "tiago_pro", ("left", "right")
AXES = ("vx", "vy", "vz", "wx", "wy", "wz")

ARM = """
[[arm]]
urdf = "example-robot-data/robots/so_arm_description/urdf/so101.urdf"
prefix = "{0}_"
translation = [0.0, {1}, 0.04]
joints = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"]
[[hand]]
name = "{0}"
frame = "{0}_gripper_frame_link"
"""


def bi_so101(folder: Path):
    """Return two SO-101 beside each other on a table."""
    one = tomllib.loads((EXAMPLES / "so101.toml").read_text())
    limits = "\n".join(f"{name} = {values * 2}" for name, values in one["limits"].items())
    (folder / "two.toml").write_text(
        'name = "two"\n[base]\nkind = "fixed"\nmass = 1.0\nheight = 0.04\nsize = [0.1, 0.4]\n'
        + ARM.format("left", 0.15)
        + ARM.format("right", -0.15)
        + f"[home]\nq = {one['home']['q'] * 2}\n[limits]\n{limits}\n"
        + '[[collision]]\nname = "plate"\nframe = "left_base_link"\nsphere = 0.01\n'
        + "[self_collision]\npairs = []\n"
    )
    return load_description(folder / "two.toml")


def ahead(hand, speed):
    return {f"{hand}.{axis}": 0.0 for axis in AXES} | {f"{hand}.vx": speed}


def test_each_hand_goes_and_closes_as_it_is_told_and_a_pair_stays_together():
    drive = Drive(robot=TIAGO)
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


@pytest.mark.parametrize("units", ["bi_so_follower", "bi_openarm_follower"])
def test_units_of_lerobot_s_two_armed_robots(tmp_path, units):
    """The names are LeRobot's; what is said and read again is the same, each hand's gripper by itself."""
    from lerobot.robots.openarm_follower.config_openarm_follower import LEFT_DEFAULT_JOINTS_LIMITS

    description = bi_so101(tmp_path)
    known = robot_units(units, description)
    joints = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"]
    if units == "bi_openarm_follower":
        joints = list(LEFT_DEFAULT_JOINTS_LIMITS)[: len(joints)]
    names = [f"{hand}_{joint}.pos" for hand in HANDS for joint in joints]
    assert known.action_names == (*names, "left_gripper.pos", "right_gripper.pos")
    q = description.home + 0.1
    said = known.action(q, np.zeros(10), np.zeros(3), (0.25, 1.0))
    reading = known.read(said)
    np.testing.assert_allclose(reading.arm, q)
    np.testing.assert_allclose(reading.openings, [0.75, 0.0])
    assert said[names[0]] == pytest.approx(np.degrees(q[0]))
    opened = {"bi_so_follower": 35.0, "bi_openarm_follower": LEFT_DEFAULT_JOINTS_LIMITS["gripper"][0]}
    assert said["left_gripper.pos"] == pytest.approx(0.75 * opened[units])
    assert known.read({name: value for name, value in said.items() if name != "right_gripper.pos"}) is None


def test_two_arms_on_a_base_add_its_velocities_and_the_head():
    names = robot_units("bi_so_follower", load_description("bi_so101")).action_names
    assert {"left_elbow_flex.pos", "right_gripper.pos", "head_pan.pos", "x.vel", "theta.vel"} < set(names)


def test_units_of_reachy2_are_its_names():
    from dataclasses import replace

    from lerobot.robots.reachy2.robot_reachy2 import (
        REACHY2_L_ARM_JOINTS,
        REACHY2_NECK_JOINTS,
        REACHY2_R_ARM_JOINTS,
        REACHY2_VEL,
    )

    arms = [*REACHY2_L_ARM_JOINTS, *REACHY2_R_ARM_JOINTS]
    joints = [name.removesuffix(".pos") for name in (*arms, *REACHY2_NECK_JOINTS) if "gripper" not in name]
    tiago = load_description(TIAGO)
    limits = type(tiago.limits)(**{name: each[:20] for name, each in vars(tiago.limits).items()})
    description = replace(
        tiago, arms=(replace(tiago.arms[0], joints=tuple(joints)),), home=tiago.home[:20], limits=limits
    )
    known = robot_units("reachy2", description)
    assert set(known.action_names) == {*arms, *REACHY2_NECK_JOINTS, *REACHY2_VEL}
    said = known.action(np.full(17, 0.5), np.zeros(17), np.array([0.1, 0.0, 0.2]), (0.0, 1.0))
    assert said["mobile_base.vtheta"] == pytest.approx(np.degrees(0.2))
    assert (said["l_gripper.pos"], said["r_gripper.pos"]) == (130.0, 0.0)


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
    description = bi_so101(tmp_path) if hands == 2 else load_description(EXAMPLES / "so101.toml")
    with pytest.raises(HandrailError, match=words):
        robot_units({"joints": {}} | table, description)

"""A robot with two hands does tasks with either; each grasps for itself, and a recording names both."""

import numpy as np
import pytest
from collect_helpers import Watcher

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import (
    build_controller,
    build_env,
    build_mode,
    build_modes,
    build_session,
    session_features,
)
from handrail.collect.world.observation import from_numbers, to_numbers
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import load_model

ROBOT = "tiago_pro"
TOOLS = ("left.tool", "right.tool")


@pytest.mark.parametrize("hand", ["left", "right"])
def test_either_hand_reaches(hand):
    config = SessionConfig(task="reach", robot=ROBOT, hand=hand)
    env, watcher = build_env(config, 20), Watcher()
    outcome = build_session(config, env, (watcher,)).run(1)
    assert outcome.success
    assert outcome.contact_onsets == 0
    features = session_features(env)
    assert features["action"].names[-2:] == ("left.gripper", "right.gripper")
    assert {f"{tool}.x" for tool in TOOLS} < set(features["observation.state"].names)
    frame = watcher.frames[-1]
    channels = Channels.of(env.model.description)
    np.testing.assert_array_equal(frame.intent.mask, channels.mask(hand))
    assert frame.action.shape == features["action"].shape == (22,)
    assert frame.state.shape == features["observation.state"].shape


@pytest.mark.parametrize("axis", ["vz", "wy"])
def test_an_arm_that_nobody_steers_stays_as_the_torso_moves(axis):
    env, mode = build_env(SessionConfig(robot=ROBOT, task="reach", hand="left"), 20), MODES["ee"]
    env.reset(seed=0)
    channels, controller = Channels.of(env.model.description), build_controller(mode, env.model, 20)
    controller.reset()
    idle, before = channels.moving(1) & ~channels.moving(0), env.state().q
    for _ in range(20):
        intent = Intent(0.2 * channels.mask(f"left.{axis}"), channels.mask("left"), time=env.state().time)
        command = controller.update(env.state(), intent)
        env.step(np.append(command.velocity(env.period), [0.0, 0.0]))
    moved = np.abs(env.state().q - before)
    assert moved[env.model.joints.index("torso_lift_joint")] > 0.01
    assert moved[idle].max() < 0.01


@pytest.mark.parametrize(
    ("task", "mode"),
    [
        ("tray", "ee"),
        ("reach", "ee_dls"),
        ("reach", "decoupled"),
        ("reach", "both"),
        ("reach", "pair"),
        ("reach", "hand+torso"),
    ],
)
def test_objectives_and_completions_are_of_the_hand_that_does_it(task, mode):
    """The second hand: what is meant for the first would leave its tray to tilt, and the hand where it is."""
    config = SessionConfig(task=task, mode=mode, robot=ROBOT, hand="right")
    assert build_session(config, build_env(config, 20)).run(0).success


def test_a_held_object_moves_with_the_hand():
    """And comes through an environment's numbers with its hand; the other hand's gripper is open."""
    env = build_env(SessionConfig(task="tray", robot=ROBOT, hand="right"), 20)
    env.reset(seed=0)
    closed = np.append(np.zeros(env.model.size), [0.0, 1.0])
    for _ in range(5):
        env.step(closed)
    (held,) = env.plant.held()
    assert held.frame == "right.tool"
    left, right = env.plant.openings
    assert left == pytest.approx(1.0)
    assert right < 0.8
    obstacles = env.obstacles()
    again = from_numbers(to_numbers(obstacles, TOOLS), TOOLS)
    assert [each.frame for each in again] == [each.frame for each in obstacles]
    with pytest.raises(HandrailError, match="held by hand 1 to 1"):
        from_numbers(to_numbers(obstacles, TOOLS))
    before = env.plant.tools[1]
    np.testing.assert_allclose(env.task_state().tool.position, before.position)
    assert env.task_state().opening == right


def test_a_mode_of_two_hands_is_only_for_robots_that_have_them():
    one, two = (build_env(SessionConfig(robot=robot), 20) for robot in ("lekiwi", ROBOT))
    added = {*build_modes(SessionConfig(), two)} - {*build_modes(SessionConfig(), one)}
    assert added == {"both", "pair", "hand+torso"}
    with pytest.raises(HandrailError, match="mode pair: expected a robot with 2 hands, got lekiwi with 1"):
        build_mode(SessionConfig(mode="pair"), one.model)
    channels = Channels.of(two.model.description)
    for mode, masked in (("both", 12), ("pair", 6), ("hand+torso", 7)):
        assert channels.mask(*MODES[mode].owned("hand", "left")).sum() == masked
    steered = MODES["pair"].leaving(("ee.wx", "ee.wy"), ()).owned("hand", "left")
    assert steered == ("pair.vx", "pair.vy", "pair.vz", "pair.wz")


def test_a_hand_that_is_not_there_is_refused_in_a_line():
    with pytest.raises(HandrailError, match="unknown hand 'third': expected one of left, right"):
        build_env(SessionConfig(robot=ROBOT, hand="third"), 20)
    with pytest.raises(HandrailError, match=r"unknown hand 'left': expected one of '' \(it has one hand\)"):
        build_env(SessionConfig(robot="lekiwi", hand="left"), 20)


def test_a_mode_of_channels_that_a_robot_lacks_is_refused_before_anything_is_written():
    told = "mode hand\\+torso: expected a robot with channels torso, got bi_so101"
    with pytest.raises(HandrailError, match=told):
        build_mode(SessionConfig(mode="hand+torso"), load_model("bi_so101"))

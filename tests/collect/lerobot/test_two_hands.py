"""LeRobot's plugins with two hands: names by one rule, and the hand that is told does the task."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from handrail.collect.lerobot import (
    HandrailEnvConfig,
    HandrailScripted,
    HandrailScriptedConfig,
    HandrailSim,
    HandrailSimConfig,
)
from handrail.collect.lerobot.mode_action import ModeAction
from handrail.collect.operators.modes import MODES, TeleopMode, always
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.description import load_description

ROBOT = "tiago_pro"
CHANNELS = Channels.of(load_description(ROBOT))
GRIPPERS = ("left.gripper.pos", "right.gripper.pos")


def test_a_script_steers_the_hand_that_is_told_through_lerobot_s_interfaces():
    robot = HandrailSim(HandrailSimConfig(robot=ROBOT, task="reach", hand="right", realtime=False))
    names = [f"right.{axis}" for axis in ("x.vel", "y.vel", "z.vel", "wx.vel", "wy.vel", "wz.vel")]
    assert list(robot.action_features) == [*names, *GRIPPERS]
    teleoperator = HandrailScripted(HandrailScriptedConfig())
    robot.connect()
    teleoperator.connect()
    seen = robot.get_observation()
    assert {"left.tool.x.pos", "right.gripper.opening.pos", "sent.left.gripper"} <= set(seen)
    assert list(seen) == list(robot.observation_features)
    for _ in range(200):
        said = robot.send_action(teleoperator.get_action())
        assert list(said) == list(robot.action_features)
        if (seen := robot.get_observation())["success"]:
            break
    assert seen["success"] == 1.0
    assert seen["brakes"] == 0.0
    robot.disconnect()


@pytest.mark.parametrize(("mode", "size"), [("ee", 8), ("pair", 8), ("both", 14), ("", 22)])
def test_the_environment_takes_what_its_settings_say(mode, size):
    config = HandrailEnvConfig(task="reach", robot=ROBOT, hand="right", mode=mode)
    assert config.features["action"].shape == (size,)
    if mode == "ee":  # one is enough: they take seconds
        env = gymnasium.make(config.gym_id, disable_env_checker=True, **config.gym_kwargs)
        observation, _ = env.reset(seed=0)
        assert env.action_space.shape == (size,)
        assert observation["agent_pos"].shape == config.features["agent_pos"].shape
        before = observation["agent_pos"]
        action = np.zeros(size)
        action[2], action[-1] = 0.1, 1.0
        for _ in range(20):
            observation, *_ = env.step(action)
        names = env.get_wrapper_attr("agent_names")
        moved = dict(zip(names, observation["agent_pos"] - before, strict=True))
        assert moved["right.tool.z"] > 0.05 > abs(moved["left.tool.z"])
        assert moved["right.gripper.opening"] < -0.3
        assert abs(moved["left.gripper.opening"]) < 0.05
        env.close()


def test_a_twist_in_a_tool_s_axes_is_turned_by_that_hand_s_own():
    turns = [np.diag([-1.0, -1.0, 1.0]), np.diag([1.0, -1.0, -1.0])]
    values = np.arange(1.0, 1.0 + CHANNELS.size)
    for mode, hands in (("both", (0, 1)), ("pair", (0,))):
        mask = CHANNELS.mask(*MODES[mode].owned("hand"))
        intent = Intent(values, mask, (0.0, 1.0), frames=Frames(tool="tool"))
        said = list(ModeAction(MODES[mode], CHANNELS).action(intent, turns).values())
        twists = values[mask][: 6 * len(hands)].reshape(-1, 2, 3)
        turned = np.ravel([twist @ turns[hand].T for hand, twist in zip(hands, twists, strict=True)])
        np.testing.assert_allclose(np.array(said, dtype=float), np.append(turned, [0.0, 1.0]))


@pytest.mark.parametrize(
    ("mode", "turns"), [("ee", True), ("switching", True), ("pair", True), ("base", True)]
)
def test_a_mode_with_whole_twists_can_say_them_in_a_tool_s_axes(mode, turns):
    assert ModeAction(MODES[mode], CHANNELS).turns is turns


@pytest.mark.parametrize("group", ["hand", "pair"])
def test_a_mode_with_some_axes_refuses_the_tool_s(group):
    """Law: the wish along an axis of the tool is kept or refused; a part of it is no answer."""
    mode = TeleopMode("some", always(group), "mpc", "some axes").leaving(("ee.wx",), ())
    action, mask = ModeAction(mode, CHANNELS, "left"), CHANNELS.mask(*mode.owned("hand", "left"))
    intent = Intent(np.ones(CHANNELS.size), mask, (0.0, 0.0), frames=Frames(tool="tool"))
    assert not action.turns
    with pytest.raises(HandrailError, match=r"^action of mode some: .* axes"):
        action.action(intent, [np.eye(3)] * 2)
    said = action.action(replace(intent, frames=Frames()), [np.eye(3)] * 2)
    assert sum(said.values()) == mask.sum()

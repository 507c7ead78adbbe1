"""LeRobot's robot: what is recorded replays exactly, whatever is no command brakes, buttons begin anew."""

import numpy as np
import pytest
from lerobot.rollout.context import HardwareContext
from lerobot.rollout.robot_wrapper import ThreadSafeRobot
from lerobot.rollout.strategies.core import RolloutStrategy
from lerobot_helpers import loop, steered

from handrail.collect.config import SessionConfig
from handrail.collect.lerobot import HandrailScripted, HandrailScriptedConfig, HandrailSim, HandrailSimConfig
from handrail.collect.lerobot.mode_action import AGAIN, HOLD, NEXT, ModeAction
from handrail.collect.operators.modes import MODES
from handrail.collect.seeds import evaluation_seed
from handrail.collect.session.build import build_env
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.registry import fitting
from handrail.controllers.robot.model import load_model


@pytest.mark.parametrize(
    ("task", "mode"), [("reach", "ee"), ("reach", "switching"), ("pick_place", "direct"), ("tray", "ee")]
)
def test_actions_as_a_dataset_keeps_them_replay_exactly(task, mode, tmp_path):
    with steered(tmp_path, task=task, mode=mode) as (robot, teleop):
        actions = loop(robot, teleop, 40)
        first = robot.get_observation()
        assert first.keys() == robot.observation_features.keys()
        robot.send_action(actions[0] | {AGAIN: 1.0})
        for action in actions:
            robot.send_action({name: np.float32(value) for name, value in action.items()})
        assert robot.get_observation() == first
        assert first["brakes"] == 0
        assert any(abs(first[f"sent.{name}"]) > 0.01 for name in robot.env.model.joints)


@pytest.mark.parametrize("task", fitting(TASKS, 1))
def test_lerobot_s_rollout_takes_every_number_of_robot_scene_and_action(task):
    for mode in fitting(MODES, 1):
        robot = HandrailSim(HandrailSimConfig(task=task, mode=mode, diagnostics=False))
        for names in (robot.observation_features, robot.action_features):
            assert all(name.endswith((".pos", ".vel")) for name in names)
        assert len(robot.observation_features) == len(robot.env.agent_names + robot.env.state_names)


def test_an_action_with_the_names_of_older_datasets_moves_the_robot_alike(tmp_path):
    with steered(tmp_path) as (robot, teleop):
        actions = loop(robot, teleop, 20)
        first = robot.get_observation()
        robot.send_action(actions[0] | {AGAIN: 1.0})
        names = ("ee.vx", "ee.vy", "ee.vz", "ee.wx", "ee.wy", "ee.wz", "gripper")
        for action in actions:
            robot.send_action(dict(zip(names, action.values(), strict=True)))
        assert robot.get_observation() == first


@pytest.mark.parametrize("mode", ["ee", "direct"])
def test_lerobot_leads_the_robot_back_and_the_next_scene_begins(mode, tmp_path, monkeypatch):
    monkeypatch.setattr("lerobot.rollout.strategies.core.precise_sleep", lambda seconds: None)
    with steered(tmp_path, mode=mode, evaluation=True) as (robot, teleop):
        start = robot.get_observation()
        first = {name: value for name, value in start.items() if name.endswith(".pos")}
        hardware = HardwareContext(ThreadSafeRobot(robot), None, first)
        loop(robot, teleop, 30)
        away = robot.get_observation()
        robot.send_action({name: away[name] for name in first})  # LeRobot's handover to an operator
        assert robot.get_observation()["scene"] == 0
        RolloutStrategy._return_to_initial_position(hardware)
        now, joints = robot.view.state.q, robot.env.model.joints
        assert max(abs(away[f"{name}.pos"] - start[f"{name}.pos"]) for name in joints) > 0.1
        np.testing.assert_allclose(now, [start[f"{name}.pos"] for name in joints], atol=0.02)
        assert not robot.loop.now.success
        following = robot.get_observation()
        assert (following["scene"], robot.get_observation()) == (1, following)
        RolloutStrategy._return_to_initial_position(hardware)  # as before an episode that is recorded again
        assert robot.get_observation()["scene"] == 1


def test_leading_the_joints_back_stops_as_long_as_somebody_says_so(tmp_path):
    with steered(tmp_path, mode="direct") as (robot, teleop):
        first = {name: value for name, value in robot.get_observation().items() if name.endswith(".pos")}
        loop(robot, teleop, 30)
        robot.watch = lambda repeated: HOLD
        for _ in range(40):
            robot.send_action(dict(first))
        assert robot.loop.rests
        held = robot.view.state.q
        robot.send_action(dict(first))
        assert np.array_equal(robot.view.state.q, held)
        robot.watch = lambda repeated: ""
        for _ in range(200):
            robot.send_action(dict(first))
        back = [first[f"{name}.pos"] for name in robot.env.model.joints]
        np.testing.assert_allclose(robot.view.state.q, back, atol=0.02)


def test_scenes_of_an_evaluation_are_those_of_handrail_evaluate(tmp_path):
    with steered(tmp_path, evaluation=True, seed=2, episode=7) as (robot, _):
        expected, _ = build_env(SessionConfig(task="reach"), 20).reset(seed=evaluation_seed(2, 7))
        shown = list(robot.get_observation().values())
        size = len(expected["agent_pos"])
        np.testing.assert_array_equal(shown[:size], expected["agent_pos"])
        np.testing.assert_array_equal(shown[size:][:7], expected["environment_state"])


@pytest.mark.parametrize("mode", ["ee", "switching"])
@pytest.mark.parametrize("focus", [0.0, 1.0])
def test_no_number_of_an_action_may_be_none(mode, focus):
    action = ModeAction(MODES.find(mode), Channels.of(load_model().description))
    numbers = np.array([focus if name == "focus.pos" else 0.1 for name in action.names])
    assert action.intent(numbers, 0.0).is_finite
    for index in range(len(numbers)):
        wrong = np.where(np.arange(len(numbers)) == index, np.nan, numbers)
        assert not action.intent(wrong, 0.0).is_finite


def test_a_malformed_command_brakes_and_is_counted(tmp_path):
    with steered(tmp_path) as (robot, teleop):
        actions = loop(robot, teleop, 20)
        for name, value in (("ee.x.vel", np.nan), ("ee.x.vel", np.inf), ("gripper.pos", np.nan)):
            robot.send_action(actions[-1] | {name: value})
        observed = robot.get_observation()
        assert observed["brakes"] == 3
        assert list(Status)[int(observed["status"])] is Status.INVALID_INTENT
        assert all(np.isfinite(list(observed.values())))
        with pytest.raises(HandrailError, match=r"expected ee\.x\.vel.*missing: ee\.z\.vel"):
            robot.send_action({name: value for name, value in actions[-1].items() if name != "ee.z.vel"})


def test_a_held_robot_comes_to_rest_and_time_stands_still(tmp_path):
    with steered(tmp_path) as (robot, teleop):
        actions = loop(robot, teleop, 30)
        for _ in range(60):
            robot.send_action(actions[-1] | {HOLD: 1.0})
        resting = robot.get_observation()
        assert not any(resting[f"sent.{name}"] for name in robot.env.model.joints)
        robot.send_action(actions[-1] | {HOLD: 1.0})
        assert robot.get_observation() == resting


def test_scenes_are_those_of_the_recording_with_this_seed(tmp_path):
    with steered(tmp_path, seed=3) as (robot, _):
        start, still = robot.get_observation(), robot.action.still()
        robot.send_action(still | {NEXT: 1.0})
        second = robot.get_observation()
        assert (start["scene"], second["scene"]) == (0, 1)
        assert second["goal.x.pos"] != start["goal.x.pos"]
    with steered(tmp_path, seed=3, episode=1) as (robot, _):
        assert robot.get_observation() == second


def test_a_teleoperator_needs_the_robot_that_it_steers(tmp_path):
    teleop = HandrailScripted(HandrailScriptedConfig(calibration_dir=tmp_path))
    robot = HandrailSim(HandrailSimConfig(calibration_dir=tmp_path))
    with pytest.raises(HandrailError, match="connect"):
        robot.get_observation()
    del robot
    with pytest.raises(HandrailError, match=r"expected --robot\.type=handrail_sim"):
        teleop.connect()


@pytest.mark.parametrize("wrong", [{"task": "reech"}, {"mode": "hand"}, {"fps": 500}, {"episode": -1}])
def test_a_wrong_setting_is_named(wrong, tmp_path):
    with pytest.raises(HandrailError, match=str(*wrong.values())):
        HandrailSim(HandrailSimConfig(calibration_dir=tmp_path, **wrong))


@pytest.mark.needs_gl
def test_a_camera_with_the_name_of_a_number_takes_none_away(tmp_path):
    with steered(tmp_path, camera_names="wrist,scene", image_size="32") as (robot, _):
        seen = robot.get_observation()
        assert seen.keys() == robot.observation_features.keys()
        assert {np.shape(seen[name]) for name in robot.cameras} == {(32, 32, 3)}
        assert seen["scene.number"] == 0
    with steered(tmp_path, camera_names="wrist", image_size="32") as (robot, _):
        assert robot.get_observation()["scene"] == 0


def test_a_scene_is_reported_once(tmp_path, caplog):
    with steered(tmp_path) as (robot, teleop), caplog.at_level("INFO"):
        loop(robot, teleop, 3)
        robot.disconnect()
        robot.connect()
    assert sum("success" in record.message for record in caplog.records) == 1

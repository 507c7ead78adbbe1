"""LeRobot's robot: what is recorded replays exactly, whatever is no command brakes, buttons begin anew."""

import numpy as np
import pytest
from lerobot_helpers import loop, steered

from handrail.collect.lerobot import HandrailScripted, HandrailScriptedConfig, HandrailSim, HandrailSimConfig
from handrail.collect.lerobot.mode_action import AGAIN, BUTTONS, HOLD, NEXT
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.command import Status


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
        assert any(abs(first[f"sent.{name}"]) > 0.01 for name in robot.stepwise.env.model.joints)


def test_what_is_no_command_brakes_and_is_counted(tmp_path):
    with steered(tmp_path) as (robot, teleop):
        actions = loop(robot, teleop, 20)
        for value in (np.nan, np.inf):
            robot.send_action(actions[-1] | {"ee.x.vel": value})
        observed = robot.get_observation()
        assert observed["brakes"] == 2
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
        assert not any(resting[f"sent.{name}"] for name in robot.stepwise.env.model.joints)
        robot.send_action(actions[-1] | {HOLD: 1.0})
        assert robot.get_observation() == resting


def test_scenes_are_those_of_the_recording_with_this_seed(tmp_path):
    with steered(tmp_path, seed=3) as (robot, _):
        start, still = robot.get_observation(), robot.stepwise.action.still()
        robot.send_action(still | {NEXT: 1.0})
        second = robot.get_observation()
        assert (start["scene"], second["scene"]) == (0, 1)
        assert second["goal.x.pos"] != start["goal.x.pos"]
    with steered(tmp_path, seed=3, episode=1) as (robot, _):
        assert robot.get_observation() == second


def test_no_button_is_recorded(tmp_path):
    with steered(tmp_path) as (robot, _):
        assert not set(BUTTONS) & {*robot.action_features, *robot.observation_features}


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

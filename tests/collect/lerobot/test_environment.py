"""LeRobot's evaluation runs our tasks: features are what there is to see, seeds are never a recording's."""

from importlib.util import module_from_spec, spec_from_file_location

import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv
from lerobot.envs.factory import make_env, make_env_config
from lerobot.envs.utils import env_to_policy_features, preprocess_observation
from places import ROOT

from handrail.collect.config import SessionConfig
from handrail.collect.lerobot import HandrailSim, HandrailSimConfig, plugins  # noqa: F401
from handrail.collect.lerobot.names import lerobot_name
from handrail.collect.seeds import FIRST_SEED
from handrail.collect.session.build import build_env
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError
from handrail.controllers.registry import fitting


def made(**settings):
    config = make_env_config("handrail", **settings)
    env = make_env(config, n_envs=1)["handrail"][0]
    assert isinstance(env, SyncVectorEnv)
    return config, env


@pytest.mark.parametrize("task", fitting(TASKS, 1))
def test_a_policy_reads_its_declared_features(task):
    config, env = made(task=task)
    features = env_to_policy_features(config)
    observation, _ = env.reset(seed=[3])
    told = {f"observation.{name}" for name in ("time", "sent", "obstacles")}  # to what completes intents
    seen = preprocess_observation(observation)
    assert told <= seen.keys()
    assert {key: values.shape[1:] for key, values in seen.items() if key not in told} == {
        key: feature.shape for key, feature in features.items() if key != "action"
    }
    assert env.single_action_space.shape == features["action"].shape
    assert env.call("_max_episode_steps")[0] > 0
    with_nan, *_ = env.step(np.full((1, *features["action"].shape), np.nan, np.float32))
    assert np.isfinite(with_nan["agent_pos"]).all()
    env.close()


def test_actions_of_a_mode_are_completed():
    config, env = made(task="reach", mode="ee")
    assert config.features["action"].shape == (7,)
    observation, _ = env.reset(seed=[5])
    for _ in range(20):
        after, *_ = env.step(np.array([[0.2, 0, 0, 0, 0, 0, 0]], np.float32))
    names = env.get_attr("unwrapped")[0].agent_names
    moved = {name: after["agent_pos"][0][i] - observation["agent_pos"][0][i] for i, name in enumerate(names)}
    assert moved["tool.x"] > 0.1
    assert abs(moved["tool.y"]) < 0.01
    env.close()


@pytest.mark.parametrize("mode", ["", "ee"])
def test_a_gripper_that_is_no_number_brakes(mode):
    config, env = made(task="reach", mode=mode)
    before, _ = env.reset(seed=[5])
    action = np.zeros((1, *config.features["action"].shape), np.float32)
    action[0, 0], action[0, -1] = 0.3, np.nan
    for _ in range(5):
        after, *_ = env.step(action)
    np.testing.assert_allclose(after["agent_pos"], before["agent_pos"], atol=1e-3)
    env.close()


def test_an_action_of_another_size_is_said():
    _, env = made(task="reach", mode="ee")
    env.reset(seed=[5])
    env.step(np.zeros((1, 10), np.float32))  # the whole robot's
    with pytest.raises(HandrailError, match=r"expected ee\.x\.vel, .*, gripper\.pos, got 3 numbers"):
        env.step(np.zeros((1, 3), np.float32))
    env.close()


@pytest.mark.parametrize("mode", ["ee", "switching"])
def test_lerobot_records_the_columns_that_a_policy_reads_and_writes(mode):
    config, env = made(task="pick_place", mode=mode, scene_in_state=True)
    robot = HandrailSim(HandrailSimConfig(task="pick_place", mode=mode, diagnostics=False))
    features = env_to_policy_features(config)
    assert features.keys() == {"action", "observation.state"}
    assert features["action"].shape == (len(robot.action_features),)
    observation, _ = env.reset(seed=[5])
    assert observation["agent_pos"].shape == (1, len(robot.observation_features))
    after, *_ = env.step(np.zeros((1, *features["action"].shape), np.float32))
    assert after["agent_pos"].shape == observation["agent_pos"].shape
    alone = build_env(SessionConfig(task="pick_place"), 20)
    expected, _ = alone.reset(seed=FIRST_SEED + 5)
    said = dict(zip(robot.observation_features, observation["agent_pos"][0], strict=True))
    for names, part in ((alone.agent_names, "agent_pos"), (alone.state_names, "environment_state")):
        np.testing.assert_array_equal([said[lerobot_name(name)] for name in names], expected[part])
    env.close()


@pytest.mark.parametrize("wrong", [{"task": "reech"}, {"mode": "hand"}, {"render_size": 17}])
def test_a_wrong_setting_is_named(wrong):
    with pytest.raises(HandrailError, match=str(*wrong.values())):
        make_env_config("handrail", **wrong)


def test_a_repository_of_the_hub_makes_the_same_environments():
    spec = spec_from_file_location("env", ROOT / "docs" / "lerobot" / "hub" / "env.py")
    assert spec
    assert spec.loader
    spec.loader.exec_module(module := module_from_spec(spec))
    env = module.make_env(n_envs=2)["handrail"][0]
    assert (env.num_envs, env.get_attr("task_description")) == (
        2,
        ("Move the gripper to the goal frame.",) * 2,
    )
    env.close()

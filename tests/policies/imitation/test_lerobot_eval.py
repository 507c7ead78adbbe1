"""LeRobot's evaluation on our environment, and ours: one policy on one seed moves the robot alike."""

import dataclasses
import sys

import numpy as np
import pytest
from lerobot.configs.policies import PreTrainedConfig
from lerobot.envs.factory import make_env, make_env_config, make_env_pre_post_processors
from lerobot.policies.factory import make_policy, make_pre_post_processors
from lerobot.scripts import lerobot_record, lerobot_train
from lerobot.scripts.lerobot_eval import rollout
from training_helpers import tiny

import handrail.policies.lerobot  # noqa: F401  (as LeRobot's command line has it)
from handrail.collect.config import FIRST_SEED, StoredConfig
from handrail.policies.imitation.evaluation.conditions import policy_conditions
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.rollout import run_rollout
from handrail.policies.imitation.interface.checkpoint import load_policy
from handrail.policies.imitation.training.training import train

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]
SEED, SECONDS = 3, 2.0


class Trace:
    """Keeps the states of a session."""

    def __init__(self):
        self.states = []

    def begin(self, env, seed):
        self.states.clear()

    def see(self, frame):
        self.states.append(frame.state)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    from command_helpers import command

    root = tmp_path_factory.mktemp("evaluated") / "set"
    done = command(root, "--task", "reach", "--dataset.num_episodes", 2)
    assert done.returncode == 0, done.stderr
    return root


@pytest.mark.parametrize("actions", ["realised", "recorded"])
def test_both_evaluations_move_the_robot_alike(actions, recorded, tmp_path):
    folder = trained(recorded, tmp_path / "policy", actions)
    np.testing.assert_array_equal(*both(folder, {}))


def test_a_policy_of_intents_brings_what_completes_them(recorded, tmp_path):
    """To what is left of numbers that LeRobot rounds to float32 on their way to the controller."""
    folder = trained(recorded, tmp_path / "policy", "intent")
    np.testing.assert_allclose(*both(folder, {"mode": "ee"}), atol=1e-4)


@pytest.mark.needs_gl
def test_a_policy_of_what_lerobot_recorded_and_trained(monkeypatch, tmp_path):
    root, output = tmp_path / "set", tmp_path / "policy"
    run(
        monkeypatch,
        lerobot_record,
        *("--robot.discover_packages_path=handrail.collect.lerobot", "--robot.type=handrail_sim"),
        *("--robot.diagnostics=false", "--robot.camera_names=wrist", "--robot.image_size=32"),
        *(f"--robot.calibration_dir={tmp_path}", f"--teleop.calibration_dir={tmp_path}"),
        *("--teleop.type=handrail_scripted", "--teleop.episode_time_s=3", "--teleop.reset_time_s=1"),
        *("--dataset.single_task=reach", "--dataset.fps=20", "--dataset.num_episodes=1"),
        *("--dataset.episode_time_s=3", "--dataset.reset_time_s=1", "--dataset.video=false"),
        *("--dataset.repo_id=me/set", f"--dataset.root={root}", "--dataset.push_to_hub=false"),
        "--play_sounds=false",
    )
    run(
        monkeypatch,
        lerobot_train,
        *("--dataset.repo_id=me/set", f"--dataset.root={root}", f"--output_dir={output}", "--steps=40"),
        *("--policy.type=act", "--policy.device=cpu", "--policy.pretrained_backbone_weights=null"),
        *("--policy.chunk_size=8", "--policy.n_action_steps=4", "--policy.use_vae=false"),
        *("--policy.dim_model=32", "--policy.dim_feedforward=64", "--policy.n_heads=2"),
        *("--policy.n_encoder_layers=1", "--policy.push_to_hub=false", "--batch_size=8"),
        *("--num_workers=0", "--wandb.enable=false"),
    )
    folder = output / "checkpoints" / "last" / "pretrained_model"
    seen = {"camera_names": "wrist", "image_size": 32, "scene_in_state": True}
    np.testing.assert_array_equal(*both(folder, {"mode": "ee"} | seen, mode="ee"))


def run(monkeypatch, module, *words):
    """Run a command of LeRobot's with its command line, in this process."""
    monkeypatch.setattr(sys, "argv", ["lerobot", *words])
    module.main()


def trained(root, output, actions):
    settings = tiny(root, output, actions=actions, steps=40)
    return train(dataclasses.replace(settings, dataset=StoredConfig("me/set", str(root))), quiet=True)


def both(folder, environment, **settings):
    """Return the robot's states with a policy in LeRobot's evaluation, and in ours."""
    config = EvaluateConfig(policy=(str(folder),), episodes=1, time_limit=SECONDS, task="reach", **settings)
    (condition,), _ = policy_conditions(config)
    trace = Trace()
    run_rollout(condition, FIRST_SEED + SEED, load_policy, [trace])

    env_config = make_env_config("handrail", task="reach", time_limit=SECONDS, **environment)
    env = make_env(env_config, n_envs=1)["handrail"][0]
    described = PreTrainedConfig.from_pretrained(folder)
    described.pretrained_path = folder
    policy = make_policy(described, env_cfg=env_config)
    policy.eval()
    around = make_env_pre_post_processors(env_config, described)
    policy_around = make_pre_post_processors(described, str(folder))
    done = rollout(env, policy, *around, *policy_around, seeds=[SEED], return_observations=True)
    env.close()
    size = len(trace.states[0])
    theirs = done["observation"]["observation.state"][0, : len(trace.states), :size].numpy()
    assert len(trace.states) == SECONDS * 20
    assert np.abs(np.diff(trace.states, axis=0)).max() > 1e-3
    return theirs, np.array(trace.states)

"""LeRobot's evaluation on our environment, its rollouts of our robot, and ours move the robot alike."""

import re
import shlex
import shutil
import sys
from pathlib import Path
from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest
from canned import canned, record_by_command
from lerobot.configs.policies import PreTrainedConfig
from lerobot.envs.factory import make_env, make_env_config, make_env_pre_post_processors
from lerobot.policies.factory import make_policy, make_pre_post_processors
from lerobot.scripts import lerobot_record, lerobot_rollout, lerobot_train
from lerobot.scripts.lerobot_eval import rollout
from places import ROOT
from training_helpers import tiny

import handrail.policies.lerobot  # noqa: F401  (as LeRobot's command line has it)
from handrail.collect.lerobot import HandrailSim
from handrail.collect.seeds import FIRST_SEED
from handrail.controllers.errors import HandrailError
from handrail.datasets.reading.reader import read_episodes, read_frames, read_info
from handrail.policies.imitation.evaluation.conditions import policy_conditions
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.rollout import run_rollout
from handrail.policies.imitation.interface.trained import load_policy
from handrail.policies.imitation.training.training import train

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]
SEED, SECONDS = 3, 2.0
PERIODS = int(SECONDS * 20)
TASK = {"task": "reach", "robot": "ridgeback_ur10"}
LAST = Path("checkpoints", "last", "pretrained_model")
ROBOT = ("--robot.discover_packages_path=handrail.policies.lerobot", "--robot.type=handrail_sim")


class Trace:
    """Keeps the states of a session."""

    def __init__(self):
        self.states = []

    def begin(self, env, seed):
        self.states.clear()

    def see(self, frame):
        self.states.append(frame.state)


@pytest.fixture(scope="module")
def recorded():
    return canned(record_by_command, "--task reach --dataset.num_episodes 2")


@pytest.fixture(scope="module")
def of_intents(recorded, tmp_path_factory):
    return trained(recorded, tmp_path_factory.mktemp("intents") / "policy", "intent")


@pytest.fixture
def rolled(monkeypatch, tmp_path):
    """Let a policy drive our robot in LeRobot's rollout, and back; return the states in which it did."""

    def run_it(folder, *words):
        states, stop, at_last, seen = [], Event(), [], HandrailSim.get_observation
        ended = HandrailSim.disconnect

        def noted(robot):
            observation = seen(robot)
            states.append(robot.view.observation["agent_pos"].copy())
            if len(states) > PERIODS:  # the first one is of connect()
                stop.set()
            return observation

        def last(robot):
            at_last.append(robot.view.state.q)
            ended(robot)

        handler = SimpleNamespace(shutdown_event=stop)
        with monkeypatch.context() as patch:
            patch.setattr(HandrailSim, "get_observation", noted)
            patch.setattr(HandrailSim, "disconnect", last)
            patch.setattr(lerobot_rollout, "ProcessSignalHandler", lambda **_: handler)
            where = ("--robot.evaluation=true", f"--robot.episode={SEED}", "--robot.realtime=false")
            quick = (f"--robot.calibration_dir={tmp_path}", "--fps=1000", "--play_sounds=false")
            run(patch, lerobot_rollout, *ROBOT, *where, *quick, f"--policy.path={folder}", *words)
        first, driven = states[0][: len(at_last[0])], np.array(states[1 : PERIODS + 1])
        assert np.abs(driven[-1][: len(first)] - first).max() > 0.02
        np.testing.assert_allclose(at_last[0], first, atol=0.02)  # it was brought back
        return driven

    return run_it


def test_three_evaluations_move_the_robot_alike(recorded, rolled, tmp_path):
    folder = trained(recorded, tmp_path / "policy", "realised")
    theirs, ours = both(folder, {})
    np.testing.assert_array_equal(theirs, ours)
    np.testing.assert_allclose(rolled(folder, "--robot.mode=direct"), ours, atol=1e-4)
    with pytest.raises(HandrailError, match=r"writes 10 numbers; --robot\.mode=ee takes 7.*expected direct"):
        rolled(folder)


def test_a_policy_of_intents_brings_what_completes_them(of_intents, rolled):
    """To what is left of numbers that LeRobot rounds to float32 on their way to the controller."""
    theirs, ours = both(of_intents, {"mode": "ee"})
    np.testing.assert_allclose(theirs, ours, atol=1e-4)
    np.testing.assert_allclose(rolled(of_intents), ours, atol=1e-4)


@pytest.mark.needs_gl
def test_a_policy_of_what_lerobot_recorded_and_trained(rolled, monkeypatch, tmp_path):
    root, output = tmp_path / "set", tmp_path / "policy"
    run(
        monkeypatch,
        lerobot_record,
        *ROBOT,
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
    seen = {"camera_names": "wrist", "image_size": 32, "scene_in_state": True}
    theirs, ours = both(output / LAST, {"mode": "ee"} | seen, mode="ee")
    np.testing.assert_array_equal(theirs, ours)
    cameras = ("--robot.camera_names=wrist", "--robot.image_size=32")
    np.testing.assert_allclose(rolled(output / LAST, *cameras), ours, atol=1e-4)


LESS = {"fps": 1000, "dataset.num_episodes": 2, "dataset.episode_time_s": 2, "dataset.reset_time_s": 0.2}


def test_the_page_s_rollouts_run_to_the_end_and_record_what_they_should(
    of_intents, monkeypatch, tmp_path, capsys
):
    """Every strategy of the page, with less time; each scene of an episode is another one."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(of_intents, Path("outputs", "policy", LAST))
    page = (ROOT / "docs" / "lerobot.md").read_text().replace("\\\n", " ")
    strategies = {}
    for words in map(shlex.split, re.findall(r"^lerobot-rollout (.*)$", page, re.MULTILINE)):
        said = dict(word.removeprefix("--").split("=", 1) for word in words)
        if said["strategy.type"] == "dagger":
            continue  # it needs keys: test_lerobot_dagger.py
        said |= {name: value for name, value in LESS.items() if name in said}
        said |= {"robot.realtime": "false", "robot.calibration_dir": tmp_path, "play_sounds": "false"}
        said |= {"duration": 3} if "duration" in said else {}
        run(monkeypatch, lerobot_rollout, *(f"--{name}={value}" for name, value in said.items()))
        strategies[said["strategy.type"]] = said.get("dataset.root")
    assert strategies.keys() == {"base", "episodic", "sentry"}
    assert re.findall(r"handrail_sim: scene (\d): ", capsys.readouterr().err) == ["0", "0", "1", "0"]
    for strategy, count in (("episodic", 2), ("sentry", 1)):
        root = strategies[strategy]
        assert len(read_episodes(root)) == count
        names = read_info(root).features["observation.state"].names
        assert names
        frames = [read_frames(root, number, ["action", "observation.state"]) for number in range(count)]
        goals = [set(each["observation.state"][:, names.index("goal.x.pos")]) for each in frames]
        assert list(map(len, goals)) == [1] * count
        assert len(set.union(*goals)) == count
        assert all(np.abs(each["action"]).max() > 1e-3 for each in frames)


def run(monkeypatch, module, *words):
    """Run a command of LeRobot's with its command line, in this process."""
    monkeypatch.setattr(sys, "argv", ["lerobot", *words])
    module.main()


def trained(root, output, actions):
    return train(tiny(root, output, actions=actions, steps=40))


def both(folder, environment, **settings):
    """Return the robot's states with a policy in LeRobot's evaluation, and in ours."""
    config = EvaluateConfig(policy=(str(folder),), episodes=1, time_limit=SECONDS, **TASK, **settings)
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

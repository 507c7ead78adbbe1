"""The checkpoint of a training: a run goes on with all that it had; one that is not whole is one line."""

import os
import shutil
import zipfile
from dataclasses import replace

import command_helpers
import numpy as np
import pytest
from rl_helpers import TINY_RL

from handrail.controllers.errors import HandrailError

pytest.importorskip("stable_baselines3")
pytest.importorskip("tensorboard")
import torch

from handrail.scripts.bench.goal_reaching.config import BenchmarkConfig
from handrail.scripts.bench.goal_reaching.run import goals
from handrail.scripts.bench.rl import train as training
from handrail.scripts.bench.rl.checkpoint import Learner
from handrail.scripts.bench.rl.env import EVALUATION_SEED, FINAL_SEED, evaluation_goals
from handrail.scripts.bench.rl.train import environment, new_model, train


@pytest.fixture(scope="module")
def honest(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(training, "BUFFER", 100)
        config = replace(TINY_RL, steps=40, output_dir=str(tmp_path_factory.mktemp("runs") / "rl"))
        train(config)
    return config


@pytest.fixture
def run(honest, tmp_path):
    """A run of one's own, to be spoilt."""
    shutil.copytree(honest.folder, tmp_path / "rl")
    return replace(honest, output_dir=str(tmp_path / "rl"), resume=True, steps=60)


def other(run, tmp_path):
    """Settings of a run that starts from the networks of another."""
    return replace(run, output_dir=str(tmp_path / "new"), start_from=run.output_dir, resume=False, steps=20)


def spoil(run, change):
    """Change the parts of a checkpoint, bytes by name."""
    with zipfile.ZipFile(run.folder / "checkpoint.zip") as file:
        parts = {name: file.read(name) for name in file.namelist()}
    change(parts)
    with zipfile.ZipFile(run.folder / "checkpoint.zip", "w") as file:
        for name, data in parts.items():
            file.writestr(name, data)


def spoil_network(run, tmp_path, change):
    def spoilt(parts):
        (tmp_path / "policy.pth").write_bytes(parts["policy.pth"])
        weights = torch.load(tmp_path / "policy.pth", weights_only=True)
        change(weights, next(iter(weights)))
        torch.save(weights, tmp_path / "policy.pth")
        parts["policy.pth"] = (tmp_path / "policy.pth").read_bytes()

    spoil(run, spoilt)


def refused(words, *runs):
    for each in runs:
        with pytest.raises(HandrailError, match=words):
            train(each)


@pytest.mark.parametrize(
    "change",
    [
        lambda weights, name: weights[name].flatten()[0].fill_(torch.nan),
        lambda weights, name: weights.update(stranger=weights.pop(name)),
    ],
)
def test_networks_are_the_run_s_and_finite(change, run, tmp_path):
    spoil_network(run, tmp_path, change)
    refused(r"checkpoint\.zip.*expected a checkpoint of this run", run, other(run, tmp_path))


def test_to_start_from_a_stranger_s_run_runs_no_code(run, tmp_path):
    class MakesFolder:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "marker"),)

    spoil_network(run, tmp_path, lambda weights, name: weights.update({name: MakesFolder()}))
    refused(r"checkpoint\.zip.*expected a checkpoint", other(run, tmp_path))
    assert not (tmp_path / "marker").exists()


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"[" * 200_000])
def test_a_malformed_checkpoint_is_one_line(content, run, tmp_path):
    (run.folder / "checkpoint.zip").write_bytes(content)
    refused(r"checkpoint\.zip.*expected a checkpoint", run, other(run, tmp_path))


@pytest.mark.parametrize("lost", ["data", "policy.pth"])
def test_a_checkpoint_that_lacks_a_part_is_one_line(lost, run):
    spoil(run, lambda parts: parts.pop(lost))
    refused(r"checkpoint\.zip.*expected a checkpoint", run)


@pytest.mark.parametrize("content", ["", "[]", "[" * 200_000, "{}", '{"nonsense": 1}', '{"layers": 3}'])
def test_malformed_settings_are_one_line(content, run):
    (run.folder / "config.json").write_text(content)
    refused(r"config\.json|as the run began", run)
    command_helpers.refused("--output_dir", run.folder, "--resume", name="bench rl")


def test_a_run_goes_on_with_all_that_it_had(honest, tmp_path):
    """Law: networks, optimisers, temperature, transitions and counters are those of the checkpoint."""
    ours = Learner.resumed(honest, environment(honest))
    assert (ours.num_timesteps, ours._n_updates, ours.curve[-1]["steps"]) == (40, 19, 40)
    with zipfile.ZipFile(honest.folder / "checkpoint.zip") as file:
        file.extractall(tmp_path)
    saved = {path.stem: torch.load(path, weights_only=True) for path in tmp_path.glob("*.pth")}
    fresh = new_model(honest).policy.state_dict()
    for name, value in ours.policy.state_dict().items():
        assert torch.equal(value, saved["policy"][name]), name
    assert any(not torch.equal(value, fresh[name]) for name, value in saved["policy"].items())
    assert torch.equal(ours.log_ent_coef, saved["pytorch_variables"]["log_ent_coef"])
    memory, kept = ours.actor.optimizer.state_dict()["state"], saved["actor.optimizer"]["state"]
    assert all(torch.equal(memory[i]["exp_avg"], kept[i]["exp_avg"]) for i in kept)
    buffer = ours.replay_buffer
    assert buffer is not None
    assert (buffer.pos, buffer.full) == (39, False)  # a step is checked before its transition is kept
    assert np.all(buffer.observations[:39].any(axis=-1))


def drawn(model):
    """Return the places of the first goals that a training meets."""
    model.env.reset()
    env = model.env.envs[0].unwrapped
    found = [env.planner.goal.position]
    for _ in range(2):
        env.reset()
        found.append(env.planner.goal.position)
    return {tuple(each) for each in found}


@pytest.mark.parametrize("steps", [EVALUATION_SEED, FINAL_SEED])
def test_a_resumed_run_draws_no_goal_of_an_evaluation(steps, honest, tmp_path):
    """Law: also not where its seed and its steps add up to the evaluation's seed."""
    model = Learner.resumed(honest, environment(honest))
    model.num_timesteps = steps
    shutil.copytree(honest.folder, tmp_path / "rl")
    model.write(tmp_path / "rl")
    again = replace(honest, output_dir=str(tmp_path / "rl"))
    later = drawn(Learner.resumed(again, environment(again)))
    assert later.isdisjoint(drawn(Learner.resumed(honest, environment(honest))))
    assert later.isdisjoint(tuple(each.position) for each in evaluation_goals(5, steps))


def test_a_run_draws_no_goal_of_the_benchmark_of_its_seed(honest):
    benchmark = {tuple(each.position) for each in goals(BenchmarkConfig(goals=5, seed=1))}
    assert benchmark.isdisjoint(drawn(new_model(replace(honest, seed=1))))

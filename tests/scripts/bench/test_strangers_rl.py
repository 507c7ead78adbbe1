"""A stranger's training run runs no code: only arrays are read of it, whatever else is one line."""

import os
import shutil
from dataclasses import replace
from pathlib import Path

import command_helpers
import numpy as np
import pytest
from rl_helpers import TINY_RL

from handrail.controllers.errors import HandrailError

pytest.importorskip("stable_baselines3")
pytest.importorskip("tensorboard")
import torch

from handrail.scripts.bench.rl.checkpoint import resume_run
from handrail.scripts.bench.rl.train import new_model, train


@pytest.fixture(scope="module")
def honest(tmp_path_factory):
    config = replace(TINY_RL, steps=40, output_dir=str(tmp_path_factory.mktemp("runs") / "rl"))
    train(config)
    return config


@pytest.fixture
def run(honest, tmp_path):
    """A run of one's own, for an attack."""
    shutil.copytree(honest.folder, tmp_path / "rl")
    return replace(honest, output_dir=str(tmp_path / "rl"), resume=True, steps=60)


class MakesFolder:
    def __init__(self, path: Path) -> None:
        self._path = str(path)

    def __reduce__(self):
        return os.mkdir, (self._path,)


def checkpoint(run):
    return run.folder / "checkpoints" / "00000040"


def spoilt(run, **changes):
    """Change what a checkpoint holds."""
    file = checkpoint(run) / "state.pt"
    torch.save(torch.load(file, weights_only=True) | changes, file)


def refused(run, words, *others):
    """The law: the run is refused, and so are others that begin with it."""
    for each in (run, *others):
        with pytest.raises(HandrailError, match=words):
            train(each)


def other(run, tmp_path):
    """Settings of a run that starts from the networks of another."""
    return replace(run, output_dir=str(tmp_path / "new"), start_from=run.output_dir, resume=False, steps=20)


@pytest.mark.parametrize("name", ["networks", "transitions", "another"])
def test_what_is_pickled_is_refused(name, run, tmp_path):
    spoilt(run, **{name: MakesFolder(tmp_path / "marker")})
    refused(run, r"state\.pt.*expected a checkpoint of this run", other(run, tmp_path))
    assert not (tmp_path / "marker").exists()


@pytest.mark.parametrize("spoil", ["nan", "foreign"])
def test_networks_are_the_run_s_and_finite(spoil, run, tmp_path):
    networks = torch.load(checkpoint(run) / "state.pt", weights_only=True)["networks"]
    weights = networks["policy"]
    name = next(iter(weights))
    if spoil == "nan":
        weights[name].flatten()[0] = torch.nan
    else:
        weights["stranger"] = weights.pop(name)
    spoilt(run, networks=networks)
    refused(run, r"state\.pt.*expected a checkpoint of this run", other(run, tmp_path))


@pytest.mark.parametrize("place", [[-1, False], [41, False], [10**6, False], [0.5, False], 3, None])
def test_transitions_are_where_the_run_has_them(place, run):
    spoilt(run, place=place)
    refused(run, r"state\.pt.*expected a checkpoint of this run")


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"[" * 200_000, b"[]", b'{"a": NaN}'])
def test_a_malformed_checkpoint_is_one_line(content, run):
    (checkpoint(run) / "state.pt").write_bytes(content)
    refused(run, r"state\.pt")
    (checkpoint(run) / "state.pt").unlink()
    refused(run, r"state\.pt")


@pytest.mark.parametrize(
    "change",
    [{"updates": "x"}, {"seconds": {}}, {"success": None}, {"steps": -40}, {"steps": 41}, {"updates": 1e999}],
)
def test_a_curve_of_other_things_than_numbers_is_one_line(change, run):
    *rows, last = torch.load(checkpoint(run) / "state.pt", weights_only=True)["curve"]
    spoilt(run, curve=[*rows, last | change])
    refused(run, r"state\.pt.*expected")


def test_a_checkpoint_of_a_name_that_none_has_is_none(run):
    checkpoint(run).rename(checkpoint(run).with_name("9" * 30))
    refused(run, "expected a run with a checkpoint")


def test_no_file_is_a_link_out_of_the_checkpoint(run, tmp_path):
    shutil.move(checkpoint(run) / "state.pt", tmp_path / "outside")
    (checkpoint(run) / "state.pt").symlink_to(tmp_path / "outside")
    refused(run, r"state\.pt.*found a link out of it", other(run, tmp_path))


@pytest.mark.parametrize("content", ["", "[]", "[" * 200_000, "{}", '{"nonsense": 1}', '{"layers": 3}'])
def test_malformed_settings_are_one_line(content, run):
    (run.folder / "config.json").write_text(content)
    refused(run, r"config\.json|as the run began")
    command_helpers.refused("--output_dir", run.folder, "--resume", name="bench rl")


def test_a_run_goes_on_with_all_that_it_had(honest):
    """Law: networks, optimisers, temperature, transitions and counters are those of the checkpoint."""
    model = new_model(honest)
    curve, _ = resume_run(checkpoint(honest), model)
    saved = torch.load(checkpoint(honest) / "state.pt", weights_only=True)
    assert (model.num_timesteps, model._n_updates, curve[-1]["steps"]) == (40, 19, 40)
    assert torch.equal(model.log_ent_coef, saved["temperature"])
    for name, value in saved["networks"]["policy"].items():
        assert torch.equal(model.policy.state_dict()[name], value), name
    ours, theirs = model.actor.optimizer.state_dict(), saved["networks"]["actor.optimizer"]
    assert all(
        torch.equal(ours["state"][i]["exp_avg"], theirs["state"][i]["exp_avg"]) for i in theirs["state"]
    )
    buffer = model.replay_buffer
    assert buffer is not None
    assert [buffer.pos, buffer.full] == saved["place"]
    count = buffer.size()
    assert count > 30
    np.testing.assert_array_equal(buffer.observations[:count], saved["transitions"]["observations"].numpy())

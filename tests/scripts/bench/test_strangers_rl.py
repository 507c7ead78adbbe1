"""A stranger's training run runs no code: only arrays are read of it, whatever else is one line."""

import base64
import io
import json
import os
import pickle
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_helpers import command
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


def rewrite(archive, **members):
    """Replace members of a zip file."""
    with zipfile.ZipFile(archive) as old:
        kept = {name: old.read(name) for name in old.namelist()}
    with zipfile.ZipFile(archive, "w") as new:
        for name, content in (kept | members).items():
            new.writestr(name, content)


def refused(run, words, *others):
    """The law: one line for the run, and for others that begin with it."""
    for each in (run, *others):
        with pytest.raises(HandrailError, match=words) as raised:
            train(each)
        assert "\n" not in str(raised.value)


def other(run, tmp_path):
    """Settings of a run that starts from the networks of another."""
    return replace(run, output_dir=str(tmp_path / "new"), start_from=run.output_dir, resume=False, steps=20)


def test_pickled_settings_are_never_read(run, tmp_path):
    """Law: what Stable-Baselines3 pickles into its archive stays pickled, and the run goes on without it."""
    payload = base64.b64encode(pickle.dumps(MakesFolder(tmp_path / "marker"))).decode()
    evil = {"policy_class": {":type:": "x", ":serialized:": payload}}
    rewrite(checkpoint(run) / "model.zip", data=json.dumps(evil))
    train(run)
    train(other(run, tmp_path))
    assert not (tmp_path / "marker").exists()


@pytest.mark.parametrize("name", ["policy.pth", "pytorch_variables.pth", "another.pth"])
def test_pickled_weights_are_refused(name, run, tmp_path):
    stream = io.BytesIO()
    torch.save({"weights": MakesFolder(tmp_path / "marker")}, stream)
    rewrite(checkpoint(run) / "model.zip", **{name: stream.getvalue()})
    refused(run, "model.zip.*expected a checkpoint of this run", other(run, tmp_path))
    assert not (tmp_path / "marker").exists()


@pytest.mark.parametrize("spoil", ["nan", "foreign"])
def test_networks_are_the_run_s_and_finite(spoil, run, tmp_path):
    archive = checkpoint(run) / "model.zip"
    with zipfile.ZipFile(archive) as old:
        weights = torch.load(io.BytesIO(old.read("policy.pth")), weights_only=True)
    name = next(iter(weights))
    if spoil == "nan":
        weights[name].flatten()[0] = torch.nan
    else:
        weights["stranger"] = weights.pop(name)
    torch.save(weights, stream := io.BytesIO())
    rewrite(archive, **{"policy.pth": stream.getvalue()})
    refused(run, "model.zip.*expected a checkpoint of this run", other(run, tmp_path))


def test_pickled_transitions_are_refused(run, tmp_path):
    marker, place = MakesFolder(tmp_path / "marker"), checkpoint(run)
    with np.load(place / "replay_buffer.npz") as arrays:
        content = dict(arrays) | {"rewards": np.array([marker], dtype=object)}
    np.savez(place / "replay_buffer.npz", **content)
    refused(run, r"replay_buffer\.npz.*expected a checkpoint of this run")
    (place / "replay_buffer.npz").unlink()
    (place / "replay_buffer.pkl").write_bytes(pickle.dumps(marker))  # as earlier versions wrote it
    refused(run, "--start_from begins a new run")
    assert not (tmp_path / "marker").exists()


@pytest.mark.parametrize("name", ["model.zip", "replay_buffer.npz", "curve.json"])
@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"[" * 200_000, b"[]", b'{"a": NaN}'])
def test_a_malformed_file_of_a_checkpoint_is_one_line(name, content, run):
    (checkpoint(run) / name).write_bytes(content)
    refused(run, name.replace(".", r"\."))


@pytest.mark.parametrize(
    "change",
    [{"updates": "x"}, {"seconds": {}}, {"success": None}, {"steps": -40}, {"steps": 41}, {"updates": 1e999}],
)
def test_a_curve_of_other_things_than_numbers_is_one_line(change, run):
    file = checkpoint(run) / "curve.json"
    *rows, last = json.loads(file.read_text())
    file.write_text(json.dumps([*rows, last | change]))
    refused(run, r"curve\.json.*expected the curve of a training run")


def test_a_checkpoint_of_a_name_that_none_has_is_none(run):
    checkpoint(run).rename(checkpoint(run).with_name("9" * 30))
    refused(run, "expected a run with a checkpoint")


@pytest.mark.parametrize("name", ["model.zip", "replay_buffer.npz", "curve.json"])
def test_no_file_is_a_link_out_of_the_checkpoint(name, run, tmp_path):
    shutil.move(checkpoint(run) / name, tmp_path / "outside")
    (checkpoint(run) / name).symlink_to(tmp_path / "outside")
    refused(run, f"{name}.*found a link out of it", other(run, tmp_path))


@pytest.mark.parametrize("content", ["", "[]", "[" * 200_000, "{}", '{"nonsense": 1}', '{"layers": 3}'])
def test_malformed_settings_are_one_line(content, run):
    (run.folder / "config.json").write_text(content)
    refused(run, r"config\.json|as the run began")
    done = command("--output_dir", run.folder, "--resume", name="bench rl")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr


def test_a_run_goes_on_with_all_that_it_had(honest):
    """Law: networks, optimisers, temperature, transitions and counters are those of the checkpoint."""
    model = new_model(honest)
    curve, _ = resume_run(checkpoint(honest), model)
    place = checkpoint(honest)
    from stable_baselines3 import SAC

    saved = SAC.load(place / "model.zip", device="cpu")
    assert (model.num_timesteps, model._n_updates) == (saved.num_timesteps, saved._n_updates) == (40, 19)
    assert curve[-1]["steps"] == 40
    assert torch.equal(model.log_ent_coef, saved.log_ent_coef)
    for name, value in saved.policy.state_dict().items():
        assert torch.equal(model.policy.state_dict()[name], value), name
    ours, theirs = model.actor.optimizer.state_dict(), saved.actor.optimizer.state_dict()
    assert all(
        torch.equal(ours["state"][i]["exp_avg"], theirs["state"][i]["exp_avg"]) for i in theirs["state"]
    )
    assert model.replay_buffer is not None
    with np.load(place / "replay_buffer.npz") as arrays:
        assert [model.replay_buffer.pos, model.replay_buffer.full] == arrays["place"].tolist()
        count = model.replay_buffer.size()
        assert count > 30
        np.testing.assert_array_equal(model.replay_buffer.observations[:count], arrays["observations"])

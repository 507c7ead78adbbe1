"""Training of imitation policies that was cut off, killed or resumed: the same to the bit, or refused."""

import dataclasses
import itertools
import os
import shutil
import signal
from unittest import mock

import pytest
from canned import canned
from lerobot.scripts.lerobot_train import update_policy
from training_helpers import cut, refused, tiny, weights, write_dataset

from handrail.collect.config import StoredConfig
from handrail.policies.imitation.evaluation.conditions import read_checkpoint
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.interface.checkpoint import read_meta
from handrail.policies.imitation.training import presets, run
from handrail.policies.imitation.training.curve import read_curve
from handrail.policies.imitation.training.source import read_source
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")


def test_a_resumed_training_is_the_same_to_the_bit(trained, tmp_path):
    """With dropout, over the end of an epoch: 24 samples are three batches."""
    folder, config = trained
    again = cut(config, tmp_path / "cut")
    assert weights(train(again)) == weights(folder)
    digests = [read_checkpoint(each.folder, EvaluateConfig()).digest for each in (again, config)]
    assert digests[0] == digests[1]
    longer = train(dataclasses.replace(again, steps=8))
    assert read_meta(longer).steps == 8


def test_a_training_goes_on_with_its_own_episodes_however_the_dataset_grew(recorded, tmp_path):
    part = tiny(recorded, tmp_path / "whole", episodes=2, draw=3)
    whole = train(part)
    grown = StoredConfig(root=str(canned(write_dataset, lengths=(9, 7, 8, 5, 6))))
    assert weights(train(cut(part, tmp_path / "cut"))) == weights(whole)
    later = dataclasses.replace(cut(part, tmp_path / "later"), dataset=grown)
    chosen = read_source(dataclasses.replace(later, resume=False)).selection
    before, meta = read_source(part).selection, read_meta(whole)
    assert [row["episode_index"] for row in before.rows] == list(meta.episodes)
    assert [row["episode_index"] for row in chosen.rows] != list(meta.episodes), "a draw that shows nothing"
    resumed = train(later)
    assert weights(resumed) == weights(whole)
    assert read_meta(resumed).trained_on == meta.trained_on


def test_a_training_keeps_the_view_of_the_policy_that_it_goes_on_from(trained):
    """An older one sees the velocities of obstacles as they are recorded."""
    folder, config = trained
    meta = read_meta(folder)
    older = dataclasses.replace(meta.interface, turned_velocities=False)
    known = dataclasses.replace(meta, interface=older)
    assert read_source(config).interface == meta.interface != older
    assert read_source(config, began=known).interface == older
    assert read_source(config, earlier=known).interface == older


def test_a_training_does_not_go_on_with_other_data_steps_or_sizes(trained, tmp_path, monkeypatch):
    config = cut(trained[1], tmp_path / "cut")
    longer, fewer = (canned(write_dataset, lengths=lengths) for lengths in ((9, 8, 7), (9, 7)))
    for root, said in ((longer, "got others"), (fewer, "has no episode 2")):
        refused(dataclasses.replace(config, dataset=StoredConfig(root=str(root))), said)
    refused(dataclasses.replace(config, steps=5), "--steps 5: expected 6 or more")
    monkeypatch.setitem(presets.ACT_CPU, "dropout", 0.1)
    refused(config, r"dropout 0\.1: expected 0\.0")


def test_the_curve_has_a_row_every_fifty_updates_also_after_a_cut(recorded, tmp_path):
    config = tiny(recorded, tmp_path / "policy", steps=100, save_freq=50)
    train(config)
    first = read_curve(config.folder)
    assert [row["step"] for row in first] == [50, 100]
    assert first[1]["loss"] < first[0]["loss"]
    shutil.rmtree(config.folder / "checkpoints" / "000100")
    train(dataclasses.replace(config, resume=True))
    again = read_curve(config.folder)
    assert [(row["step"], row["loss"]) for row in again] == [(row["step"], row["loss"]) for row in first]


def test_a_training_that_is_interrupted_saves_a_checkpoint_and_goes_on_to_the_same_losses(tmp_path):
    """SIGTERM comes while an update is made, between two rows of the curve and two measurements."""
    root = canned(write_dataset, lengths=(9, 7, 8, 5, 6, 7, 8))
    whole = tiny(root, tmp_path / "whole", steps=100, save_freq=1000, eval_split=0.3, eval_steps=40)
    cut_off = dataclasses.replace(whole, output=str(tmp_path / "cut"))
    words = "^training: interrupted; --resume goes on after update 63$"
    with (
        mock.patch.object(run, "update_policy", interrupted(at=63)),
        pytest.raises(KeyboardInterrupt, match=words),
    ):
        train(cut_off)
    policies = train(dataclasses.replace(cut_off, resume=True)), train(whole)
    assert weights(policies[0]) == weights(policies[1])
    metas = [read_meta(each).validation for each in policies]
    assert metas[0] == metas[1]
    curves = [[(row["step"], row["loss"]) for row in read_curve(each.folder)] for each in (cut_off, whole)]
    assert curves[0] == curves[1]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("pretrained_model/model.safetensors", b"half"),
        ("training_state/optimizer_state.safetensors", b"half"),
        ("training_state/training_step.json", b"{}"),
    ],
)
def test_a_damaged_checkpoint_is_one_line(name, content, trained, tmp_path):
    config = cut(trained[1], tmp_path / "cut")
    (config.folder / "checkpoints" / "000003" / name).write_bytes(content)
    refused(config, "^policy act: ")


def interrupted(at):
    """Return LeRobot's update, during one of which this process is told to end."""
    updates = itertools.count(1)

    def update(*arguments):
        if next(updates) == at:
            os.kill(os.getpid(), signal.SIGTERM)
        return update_policy(*arguments)

    return update


def test_without_steps_a_training_goes_on_to_the_length_it_began_with(trained, tmp_path):
    """Not to that of the preset, on another learning rate."""
    folder, config = trained
    again = dataclasses.replace(cut(config, tmp_path / "cut"), steps=0, resume=True)
    resumed = train(again)
    assert read_meta(resumed).steps == config.steps
    assert weights(resumed) == weights(folder)

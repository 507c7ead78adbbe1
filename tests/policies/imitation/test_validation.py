"""The loss on held-out episodes: measured where it says so, to the same bit, nothing learnt from them."""

import dataclasses
import shutil

import numpy as np
import pytest
from canned import canned
from training_helpers import refused, tiny, weights, write_dataset

from handrail.policies.imitation.interface.checkpoint import point_to, read_meta
from handrail.policies.imitation.training.selection import hold_out
from handrail.policies.imitation.training.source import read_source
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")
MEASURED = {"eval_split": 0.1, "eval_steps": 5, "steps": 12, "save_freq": 4}


@pytest.fixture(scope="session")
def many():
    return canned(write_dataset, lengths=(9, 7, 8, 6, 5, 9, 8))


@pytest.fixture(scope="session")
def measured(many, tmp_path_factory):
    """A training that measures, and its settings."""
    config = tiny(many, tmp_path_factory.mktemp("measured") / "policy", "dropout=0.1", **MEASURED)
    return train(config), config


@pytest.mark.parametrize(("episodes", "share", "held"), [(7, 0.1, 5), (60, 0.1, 6), (100, 0.2, 20)])
def test_episodes_are_held_out_by_draw_alone_and_none_twice(episodes, share, held, tmp_path):
    rows = [{"episode_index": number, "length": 3} for number in range(episodes)]
    config = tiny(tmp_path, tmp_path, eval_split=share)
    learnt, out = hold_out(rows, config)
    assert (len(learnt), len(out)) == (episodes - held, held)
    assert sorted(row["episode_index"] for row in (*learnt, *out)) == list(range(episodes))
    assert hold_out(rows, dataclasses.replace(config, seed=5)) == (learnt, out)
    others = [hold_out(rows, dataclasses.replace(config, draw=draw))[1] for draw in range(1, 6)]
    assert any(other != out for other in others)


def test_too_few_episodes_to_hold_some_out_is_one_line(recorded, tmp_path):
    config = tiny(recorded, tmp_path / "policy", eval_split=0.1)
    refused(config, r"--eval_split 0\.1: expected more than 5 episodes")
    assert not (tmp_path / "policy").exists()


def test_held_out_episodes_teach_nothing_not_even_a_scale(many, tmp_path):
    config = tiny(many, tmp_path, eval_split=0.1)
    source = read_source(config)
    learnt, out = (source.only(rows) for rows in source.split)
    numbers = [{row["episode_index"] for row in part.selection.rows} for part in (learnt, out)]
    assert not numbers[0] & numbers[1]
    assert len(learnt.columns["action"]) + len(out.columns["action"]) == len(source.columns["action"])
    whole = source.columns
    frames = np.concatenate([np.full(row["length"], row["episode_index"]) for row in source.selection.rows])
    inside = np.isin(frames, list(numbers[0]))
    np.testing.assert_array_equal(learnt.columns["action"], whole["action"][inside])
    np.testing.assert_array_equal(learnt.columns["index"], np.arange(inside.sum()))
    assert source.trained_on["episodes"] == len(numbers[0])
    assert source.trained_on["attempts"] == 7


def test_it_is_measured_every_so_many_updates_and_after_the_last(measured):
    folder, config = measured
    found = read_meta(folder).validation
    assert sorted(map(int, found)) == [5, 10, 12]
    assert len({*found.values()}) == 3
    assert train(dataclasses.replace(config, resume=True)) == folder  # nothing is left to do


def test_measuring_changes_nothing(many, tmp_path):
    """The same updates with and without measurements in between: nothing random is used up."""
    config = tiny(many, tmp_path / "often", "dropout=0.1", eval_split=0.1, eval_steps=1)
    rarely = dataclasses.replace(config, output=str(tmp_path / "rarely"), eval_steps=100)
    assert weights(train(config)) == weights(train(rarely))


def test_cut_off_anywhere_it_ends_the_same_to_the_bit(measured, tmp_path):
    folder, config = measured
    whole = sorted(path.name for path in (config.folder / "checkpoints").glob("[0-9]*"))
    assert len(whole) > 1
    for kept in range(1, len(whole)):
        cut = tmp_path / whole[kept]
        shutil.copytree(config.folder, cut, symlinks=True)
        for name in whole[kept:]:
            shutil.rmtree(cut / "checkpoints" / name)
        again = train(dataclasses.replace(config, output=str(cut), resume=True))
        assert weights(again) == weights(folder)
        assert read_meta(again).validation == read_meta(folder).validation


def test_a_folder_without_a_training_is_not_resumed_into(tmp_path):
    """A checkpoint's own folder, a dataset, one with somebody's files: all stay as they are."""
    made = tmp_path / "p"
    made.mkdir()
    (made / "notes.txt").write_text("mine")
    refused(
        tiny(canned(write_dataset), made, resume=True), "expected a missing or empty folder, found notes.txt"
    )
    assert [path.name for path in made.iterdir()] == ["notes.txt"]


def test_a_last_checkpoint_that_a_copy_made_a_folder_becomes_a_link_again(tmp_path):
    for name in ("000003", "last"):
        (tmp_path / name / "pretrained_model").mkdir(parents=True)
    point_to(tmp_path / "000003")
    assert (tmp_path / "last").is_symlink()
    assert (tmp_path / "last").resolve() == tmp_path / "000003"
